#include "agail/rl/trpo.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "rl/support.h"

namespace agail {
namespace {

constexpr Index kSamples = 400;
constexpr int kObservations = 4;

class TrpoTest : public testing::TestWithParam<bool> {
 protected:
  TrpoTest()
      : space_(GetParam() ? discrete_actions(3) : continuous_actions(2)),
        network_(kObservations, {8, 8}, space_),
        theta_(reference::normal_vector(network_.parameters(), 1, 0.5).cast<float>()),
        x_(reference::network_input(kObservations, kSamples, 2).cast<float>()),
        actions_(space_.dim, kSamples),
        advantages_(kSamples) {
    draw(0);
  }

  // Actions of the policy; the advantage is that of a problem with a best action for each state.
  void draw(std::uint32_t round) {
    Tape<float> tape = network_.mlp.make_tape(kSamples);
    network_.mlp.forward(theta_.data(), x_, tape, 0);
    RandomStream random(1, Purpose::kAct, 0, 0, round);
    for (Index j = 0; j < kSamples; ++j) {
      network_.distribution.sample(tape.outputs.back().col(j).data(),
                                   network_.log_std(theta_.data()), random, actions_.col(j).data());
      const float best = x_(0, j) > 0 ? 1 : 0;
      advantages_[j] = -std::abs(actions_(0, j) - best);
    }
    mean_ = static_cast<double>(advantages_.mean());
    advantages_.array() -= advantages_.mean();
    advantages_ /= std::sqrt(advantages_.squaredNorm() / static_cast<float>(kSamples));
  }

  ActionSpace space_;
  PolicyNetwork<float> network_;
  Vector<float> theta_;
  Matrix<float> x_, actions_;
  Vector<float> advantages_;
  double mean_ = 0;  // reward
  ThreadPool pool_{1};
  Stopwatch stopwatch_;
};

TEST_P(TrpoTest, StepsStayInTheTrustRegionAndImprove) {
  TrpoSettings settings;
  Trpo trpo(network_, pool_, settings, kSamples);
  const double start = mean_;
  for (std::uint32_t round = 1; round <= 30; ++round) {
    const Vector<float> old = theta_;
    const TrpoReport report =
        trpo.update(theta_, x_, actions_, advantages_, kSamples, nullptr, stopwatch_);
    ASSERT_TRUE(report.accepted);
    EXPECT_GT(report.kl, 0);
    EXPECT_LE(report.kl, 1.5 * settings.max_kl);
    EXPECT_GT(report.improvement, 0);
    // What it reports is true.
    PolicyObjective<float> objective(network_, pool_, kSamples, 1);
    objective.bind(old, x_, actions_, advantages_, kSamples, 0);
    const auto value = objective.evaluate(theta_);
    EXPECT_EQ(report.kl, value.kl);
    EXPECT_EQ(report.entropy, value.entropy);
    EXPECT_EQ(report.improvement, value.surrogate - objective.evaluate(old).surrogate);
    draw(round);
  }
  EXPECT_GT(mean_, 0.6 * start);  // both negative: the distance from the best action falls
}

// The direction is the solution of (F + damping I) s = g and the first length that of the KL ball.
TEST_P(TrpoTest, StepIsTheNaturalGradient) {
  TrpoSettings settings;
  settings.fisher_stride = 1;
  settings.cg_iterations = 200;
  settings.max_kl = 1e-4;
  settings.entropy_weight = 0.01;
  PolicyObjective<float> objective(network_, pool_, kSamples, 1);
  objective.bind(theta_, x_, actions_, advantages_, kSamples, 0.01F);
  const Index p = network_.parameters();
  const Vector<double> gradient = objective.gradient().cast<double>();
  Matrix<double> fisher(p, p);
  Vector<float> column(p);
  for (Index k = 0; k < p; ++k) {
    objective.fisher_vector_product(Vector<float>::Unit(p, k), column);
    fisher.col(k) = column.cast<double>();
  }
  EXPECT_LE((fisher - fisher.transpose()).norm(), 1e-5 * fisher.norm());
  fisher.diagonal().array() += settings.cg_damping;
  const Vector<double> direction = fisher.ldlt().solve(gradient);
  const double length = std::sqrt(2 * settings.max_kl / direction.dot(fisher * direction));

  Trpo trpo(network_, pool_, settings, kSamples);
  const Vector<float> old = theta_;
  const TrpoReport report =
      trpo.update(theta_, x_, actions_, advantages_, kSamples, nullptr, stopwatch_);
  ASSERT_TRUE(report.accepted);
  EXPECT_EQ(report.halvings, 0);
  EXPECT_NEAR(report.gradient_norm, gradient.norm(), 1e-6 * gradient.norm());
  const Vector<double> step = (theta_ - old).cast<double>();
  EXPECT_LE(reference::relative_error(step, length * direction), 1e-3);
}

// A term that only ever falls, whatever the parameters.
struct Spoiler : AuxiliaryTerm {
  explicit Spoiler(double s) : step(s) {}
  void begin_update(const Vector<float>&) override { ++begun; }
  double value(const Vector<float>&) override { return now -= step; }
  void add_gradient(const Vector<float>&, Vector<float>&) override {}
  double step, now = 0;
  int begun = 0;
};

TEST_P(TrpoTest, NothingChangesWhenNoStepIsAccepted) {
  const Vector<float> old = theta_;
  const auto refuses = [&](const TrpoSettings& settings, const Vector<float>& advantages,
                           AuxiliaryTerm* auxiliary) {
    Trpo trpo(network_, pool_, settings, kSamples);
    const TrpoReport report =
        trpo.update(theta_, x_, actions_, advantages, kSamples, auxiliary, stopwatch_);
    EXPECT_FALSE(report.accepted);
    EXPECT_EQ(report.kl, 0);
    EXPECT_EQ(report.improvement, 0);
    EXPECT_TRUE(reference::same_bits(theta_, old));
  };
  Spoiler falls(1), broken(std::numeric_limits<double>::quiet_NaN());
  refuses({}, advantages_, &falls);
  EXPECT_EQ(falls.begun, 1);
  EXPECT_EQ(falls.now, -11);  // asked at the old parameters, then after each of 10 halvings
  refuses({}, advantages_, &broken);
  refuses({.line_search_halvings = 0}, advantages_, nullptr);
  refuses({}, Vector<float>::Zero(kSamples), nullptr);
  refuses({}, Vector<float>::Constant(kSamples, std::numeric_limits<float>::quiet_NaN()), nullptr);
}

INSTANTIATE_TEST_SUITE_P(Actions, TrpoTest, testing::Bool());

}  // namespace
}  // namespace agail
