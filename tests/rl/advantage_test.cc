#include "agail/rl/advantage.h"

#include <gtest/gtest.h>

#include "rl/support.h"

namespace agail {
namespace {

constexpr int kObservations = 3;
constexpr Index kLanes = 3, kSteps = 30;

class AdvantageTest : public testing::TestWithParam<double> {
 protected:
  AdvantageTest()
      : pool_(2),
        normalizer_(kObservations, true, 5),
        batch_(kObservations, 1, kLanes, kSteps),
        value_(kObservations, {}, pool_, batch_.size(), 1),
        estimator_(kObservations, batch_.size()) {
    normalizer_.set(Vector<double>{{0.1, -0.2, 0.3}}, Vector<double>{{1, 2, 0.5}});
    batch_.observations = reference::normal_matrix(kObservations, batch_.size(), 2).cast<float>();
    // Only the columns that leave the batch have a final observation; others are undefined.
    batch_.final_observations.setConstant(std::numeric_limits<float>::quiet_NaN());
    const Matrix<float> after =
        reference::normal_matrix(kObservations, batch_.size(), 3).cast<float>();
    normalizer_.apply(pool_, batch_.observations, batch_.size(), batch_.inputs);
    for (const Index j : {4, 29, 40})
      batch_.endings[static_cast<std::size_t>(j)] = Ending::kTerminated;
    for (const Index j : {11, 12, 59})
      batch_.endings[static_cast<std::size_t>(j)] = Ending::kTruncated;
    for (const Index j : {11, 12, 59, 89}) batch_.final_observations.col(j) = after.col(j);
    rewards_ = reference::normal_vector(batch_.size(), 4).cast<float>();
    // A value net that says something.
    Vector<float> targets = 3 * batch_.observations.row(0).transpose().array().sin() + 2;
    for (std::uint32_t i = 0; i < 20; ++i) value_.fit(batch_.inputs, targets, batch_.size(), i);
  }

  double value(const Matrix<float>& observations, Index j) {
    Matrix<float> x = Matrix<float>::Zero(padded(kObservations + 1), 1);
    normalizer_.apply(observations.col(j).data(), x.data());
    Vector<float> v(1);
    value_.predict(x, 1, v);
    return static_cast<double>(v[0]);
  }

  ThreadPool pool_;
  Normalizer normalizer_;
  Batch batch_;
  ValueFunction value_;
  AdvantageEstimator estimator_;
  Vector<float> rewards_;
};

// A_t = sum_k (gamma lambda)^k delta_{t+k} up to the episode's or the lane's end.
TEST_P(AdvantageTest, EqualsTheDirectSum) {
  TrpoSettings settings;
  settings.gamma = 0.9;
  settings.lambda = 0.8;
  const double terminal_value = GetParam();
  estimator_.estimate(batch_, rewards_, value_, normalizer_, settings, terminal_value);
  const auto ends = [&](Index j) {
    return batch_.endings[static_cast<std::size_t>(j)] != Ending::kNone || j % kSteps == kSteps - 1;
  };
  for (Index t = 0; t < batch_.size(); ++t) {
    double expected = 0, factor = 1;
    for (Index j = t;; ++j) {
      double next = 0;
      if (batch_.endings[static_cast<std::size_t>(j)] == Ending::kTerminated)
        next = terminal_value;
      else if (ends(j))
        next = value(batch_.final_observations, j);
      else
        next = value(batch_.observations, j + 1);
      expected +=
          factor * (static_cast<double>(rewards_[j]) + 0.9 * next - value(batch_.observations, j));
      factor *= 0.9 * 0.8;
      if (ends(j)) break;
    }
    EXPECT_NEAR(estimator_.advantages()[t], expected, 1e-5) << t;
    EXPECT_NEAR(estimator_.targets()[t], expected + value(batch_.observations, t), 1e-5) << t;
  }
}

INSTANTIATE_TEST_SUITE_P(TerminalValue, AdvantageTest, testing::Values(0.0, -7.5));

TEST_P(AdvantageTest, NormalisedToMeanZeroAndDeviationOne) {
  estimator_.estimate(batch_, 10 * rewards_, value_, normalizer_, {}, 0);
  const double variance_explained = estimator_.explained_variance(batch_.size());
  const Eigen::ArrayXd target = estimator_.targets().cast<double>();
  const Eigen::ArrayXd error = estimator_.advantages().cast<double>();  // target - value
  const auto variance = [](const Eigen::ArrayXd& x) { return (x - x.mean()).square().mean(); };
  EXPECT_NEAR(variance_explained, 1 - variance(error) / variance(target), 1e-5);
  const Vector<float> before = estimator_.advantages();
  estimator_.normalize(batch_.size());
  const Eigen::ArrayXd after = estimator_.advantages().cast<double>();
  EXPECT_NEAR(after.mean(), 0, 1e-7);
  EXPECT_NEAR(variance(after), 1, 1e-6);
  EXPECT_NEAR((before.cast<double>().array() - error.mean() - after * std::sqrt(variance(error)))
                  .abs()
                  .maxCoeff(),
              0, 1e-4);
}

}  // namespace
}  // namespace agail
