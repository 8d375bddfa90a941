#include "agail/nn/distribution.h"

#include <gtest/gtest.h>

#include <array>

#include "nn/reference.h"

namespace agail {
namespace {

using reference::numbers;
using reference::relative_error;

ActionSpace gaussian(int dim) {
  ActionSpace space;
  space.dim = dim;
  return space;
}

ActionSpace categorical(int n) {
  ActionSpace space;
  space.discrete = true;
  space.dim = 1;
  space.n = n;
  return space;
}

constexpr Index kColumns = 6;

struct Case {
  bool discrete;
  bool masked;
};

class DistributionTest : public testing::TestWithParam<Case> {
 protected:
  DistributionTest()
      : distribution_(GetParam().discrete ? categorical(4) : gaussian(3)),
        outputs_(distribution_.outputs()),
        output_(reference::normal_matrix(outputs_, kColumns, 1)),
        log_std_(reference::normal_vector(distribution_.log_stds(), 2, 0.5)),
        actions_(reference::normal_matrix(distribution_.actions(), kColumns, 3)),
        available_(Matrix<double>::Ones(distribution_.actions(), kColumns)),
        weight_(reference::normal_matrix(1, kColumns, 4)) {
    for (Index j = 0; j < kColumns; ++j) {
      if (GetParam().discrete) actions_(0, j) = static_cast<double>((3 * j + 1) % 4);
      if (!GetParam().masked) continue;
      for (Index i = 0; i < available_.rows(); ++i)
        if ((i + 2 * j) % 3 == 0) {
          available_(i, j) = 0;
          actions_(i, j) = GetParam().discrete ? 0 : 1e30;  // must not be looked at
        }
    }
  }

  // Parameters: outputs of all columns, then log_std.
  Vector<double> point() const {
    Vector<double> p(output_.size() + log_std_.size());
    p << output_.reshaped(), log_std_;
    return p;
  }
  template <class T, class F>
  T sum(const reference::Numbers<T>& p, F&& f) const {
    T total(0.0);
    for (Index j = 0; j < kColumns; ++j) {
      const auto begin = p.begin() + j * outputs_;
      total =
          total + f(j, reference::Numbers<T>(begin, begin + outputs_), p.data() + output_.size());
    }
    return total;
  }
  template <class T>
  T weighted_log_prob(const reference::Numbers<T>& p) const {
    return sum(p, [&](Index j, const reference::Numbers<T>& output, const T* log_std) {
      return T(weight_(j)) * reference::log_prob(GetParam().discrete, output, log_std,
                                                 numbers(actions_.col(j)),
                                                 numbers(available_.col(j)));
    });
  }
  const ConstView<double>* mask() const { return GetParam().masked ? &mask_ : nullptr; }

  ActionDistribution<double> distribution_;
  Index outputs_;
  Matrix<double> output_;
  Vector<double> log_std_;
  Matrix<double> actions_, available_;
  RowVector<double> weight_;
  ConstView<double> mask_{available_};
};

TEST_P(DistributionTest, LogProbability) {
  RowVector<double> result(kColumns);
  distribution_.log_prob(output_, log_std_.data(), actions_, mask(), result);
  for (Index j = 0; j < kColumns; ++j)
    EXPECT_NEAR(result[j],
                reference::log_prob(GetParam().discrete, numbers(output_.col(j)), log_std_.data(),
                                    numbers(actions_.col(j)), numbers(available_.col(j))),
                1e-12);
}

TEST_P(DistributionTest, ScoreIsTheGradientOfTheLogProbability) {
  Matrix<double> d_output = Matrix<double>::Constant(outputs_, kColumns, 9);  // overwritten
  const Vector<double> start = reference::normal_vector(log_std_.size(), 5);
  Vector<double> d_log_std = start;  // added to
  distribution_.score(output_, log_std_.data(), actions_, mask(), weight_, d_output,
                      d_log_std.data());
  Vector<double> gradient(output_.size() + log_std_.size());
  gradient << d_output.reshaped(), d_log_std - start;
  const auto f = [&](const auto& p) { return weighted_log_prob(p); };
  EXPECT_LE(relative_error(gradient, reference::gradient(f, point())), 1e-12);
  const auto value = [&](const Vector<double>& p) {
    RowVector<double> log_p(kColumns);
    distribution_.log_prob(p.head(output_.size()).reshaped(outputs_, kColumns).eval(),
                           p.data() + output_.size(), actions_, mask(), log_p);
    return log_p.dot(weight_);
  };
  EXPECT_LE(relative_error(gradient, reference::differences(value, point())), 1e-8);
}

TEST_P(DistributionTest, Entropy) {
  const auto f = [&](const auto& p) {
    return sum(p, [&](Index, const auto& output, const auto* log_std) {
      return reference::entropy(GetParam().discrete, output, log_std);
    });
  };
  EXPECT_NEAR(distribution_.entropy(output_, log_std_.data()), f(numbers(point())), 1e-12);

  const double weight = 1.3;
  const Vector<double> start = reference::normal_vector(point().size(), 6);
  Matrix<double> d_output = start.head(output_.size()).reshaped(outputs_, kColumns);
  Vector<double> d_log_std = start.tail(log_std_.size());
  distribution_.add_entropy_gradient(output_, weight, d_output, d_log_std.data());
  Vector<double> gradient(start.size());
  gradient << d_output.reshaped(), d_log_std;
  gradient -= start;
  EXPECT_LE(relative_error(gradient, weight * reference::gradient(f, point())), 1e-11);
  const auto value = [&](const Vector<double>& p) {
    return weight *
           distribution_.entropy(p.head(output_.size()).reshaped(outputs_, kColumns).eval(),
                                 p.data() + output_.size());
  };
  EXPECT_LE(relative_error(gradient, reference::differences(value, point())), 1e-8);
}

TEST_P(DistributionTest, KullbackLeibler) {
  const Matrix<double> old_output = reference::normal_matrix(outputs_, kColumns, 7);
  const Vector<double> old_log_std = reference::normal_vector(log_std_.size(), 8, 0.3);
  RowVector<double> result(kColumns);
  distribution_.kl(old_output, old_log_std.data(), output_, log_std_.data(), result);
  for (Index j = 0; j < kColumns; ++j) {
    EXPECT_NEAR(result[j],
                reference::kl(GetParam().discrete, numbers(old_output.col(j)), old_log_std.data(),
                              numbers(output_.col(j)), log_std_.data()),
                1e-12);
    EXPECT_GT(result[j], 0);
  }
  distribution_.kl(output_, log_std_.data(), output_, log_std_.data(), result);
  EXPECT_LE(result.cwiseAbs().maxCoeff(), 1e-15);
}

// The Fisher matrix of the outputs is the Hessian of the KL there.
TEST_P(DistributionTest, FisherMatrixIsTheHessianOfTheKl) {
  Matrix<double> tangent = reference::normal_matrix(outputs_, kColumns, 9);
  Vector<double> v = Vector<double>::Zero(point().size());
  v.head(output_.size()) = tangent.reshaped();
  const auto f = [&](const auto& p) {
    return sum(p, [&](Index j, const auto& output, const auto* log_std) {
      return reference::kl(GetParam().discrete, numbers(output_.col(j)), log_std_.data(), output,
                           log_std);
    });
  };
  const Vector<double> expected = reference::hessian_vector_product(f, point(), v);
  distribution_.multiply_by_fisher(output_, log_std_.data(), tangent);
  EXPECT_LE(relative_error(tangent.reshaped(), expected.head(output_.size())), 1e-12);
  if (GetParam().discrete) return;
  EXPECT_LE(expected.tail(log_std_.size()).cwiseAbs().maxCoeff(), 1e-12);  // no mixed terms
  v.setZero();
  v.tail(log_std_.size()).setOnes();
  const Vector<double> deviations = reference::hessian_vector_product(f, point(), v);
  for (Index i = 0; i < log_std_.size(); ++i)
    EXPECT_NEAR(deviations[output_.size() + i], 2.0 * kColumns, 1e-11);
}

INSTANTIATE_TEST_SUITE_P(Both, DistributionTest,
                         testing::Values(Case{false, false}, Case{false, true}, Case{true, false},
                                         Case{true, true}));

// Sums over the density itself: neither closed form appears.
TEST(Distribution, KlAndEntropyAreTheIntegralsThatTheyStandFor) {
  const ActionDistribution<double> normal(gaussian(1));
  const Matrix<double> old_mean = Matrix<double>::Constant(1, 1, 0.4);
  const Matrix<double> mean = Matrix<double>::Constant(1, 1, -0.7);
  const double old_log_std = -0.3, log_std = 0.2;
  const double h = 1e-3;
  double kl = 0, entropy = 0, total = 0;
  for (double a = -12; a <= 12; a += h) {
    const Matrix<double> action = Matrix<double>::Constant(1, 1, a);
    RowVector<double> old_log_p(1), log_p(1);
    normal.log_prob(old_mean, &old_log_std, action, nullptr, old_log_p);
    normal.log_prob(mean, &log_std, action, nullptr, log_p);
    const double p = std::exp(old_log_p[0]) * h;
    total += p;
    kl += p * (old_log_p[0] - log_p[0]);
    entropy -= p * old_log_p[0];
  }
  RowVector<double> closed(1);
  normal.kl(old_mean, &old_log_std, mean, &log_std, closed);
  EXPECT_NEAR(total, 1, 1e-9);
  EXPECT_NEAR(closed[0], kl, 1e-9);
  EXPECT_NEAR(normal.entropy(old_mean, &old_log_std), entropy, 1e-9);

  const ActionDistribution<double> choice(categorical(3));
  const Matrix<double> old_logits = Vector<double>{{0.5, -1, 2}},
                       logits = Vector<double>{{1, 1, 0}};
  kl = entropy = total = 0;
  for (int a = 0; a < 3; ++a) {
    const Matrix<double> action = Matrix<double>::Constant(1, 1, a);
    RowVector<double> old_log_p(1), log_p(1);
    choice.log_prob(old_logits, nullptr, action, nullptr, old_log_p);
    choice.log_prob(logits, nullptr, action, nullptr, log_p);
    total += std::exp(old_log_p[0]);
    kl += std::exp(old_log_p[0]) * (old_log_p[0] - log_p[0]);
    entropy -= std::exp(old_log_p[0]) * old_log_p[0];
  }
  choice.kl(old_logits, nullptr, logits, nullptr, closed);
  EXPECT_NEAR(total, 1, 1e-13);
  EXPECT_NEAR(closed[0], kl, 1e-13);
  EXPECT_NEAR(choice.entropy(old_logits, nullptr), entropy, 1e-13);
}

TEST(Distribution, LargeLogitsDoNotOverflow) {
  const ActionDistribution<float> choice(categorical(3));
  const Matrix<float> logits = Vector<float>{{1000, -1000, 999}};
  const Matrix<float> action = Matrix<float>::Constant(1, 1, 2);
  RowVector<float> result(1);
  choice.log_prob(logits, nullptr, action, nullptr, result);
  EXPECT_NEAR(result[0], -1.313262F, 1e-5);
  choice.kl(logits, nullptr, logits, nullptr, result);
  EXPECT_EQ(result[0], 0);
  EXPECT_NEAR(choice.entropy(logits, nullptr), 0.582203, 1e-5);
}

TEST(Distribution, SamplesHaveTheRightFrequencies) {
  const ActionDistribution<float> choice(categorical(4));
  const std::array<float, 4> logits{0.5F, -1, 2, 0};
  double total = 0;
  for (const float logit : logits) total += std::exp(static_cast<double>(logit));
  std::array<int, 4> count{};
  constexpr int n = 100000;
  RandomStream random(1, Purpose::kAct);
  for (int i = 0; i < n; ++i) {
    float action = -1;
    choice.sample(logits.data(), nullptr, random, &action);
    ++count.at(static_cast<std::size_t>(action));
  }
  for (std::size_t a = 0; a < 4; ++a) {
    const double p = std::exp(static_cast<double>(logits.at(a))) / total;
    EXPECT_NEAR(count.at(a), n * p, 5 * std::sqrt(n * p * (1 - p)));
  }
  float best = -1;
  choice.mode(logits.data(), &best);
  EXPECT_EQ(best, 2);
}

TEST(Distribution, SamplesHaveTheRightMoments) {
  const ActionDistribution<float> normal(gaussian(2));
  const std::array<float, 2> mean{0.3F, -4}, log_std{0.4F, -1};
  constexpr int n = 100000;
  Eigen::Array2d sum = Eigen::Array2d::Zero(), squares = sum;
  double product = 0;
  RandomStream random(2, Purpose::kAct);
  for (int i = 0; i < n; ++i) {
    std::array<float, 2> action{};
    normal.sample(mean.data(), log_std.data(), random, action.data());
    Eigen::Array2d z;
    for (std::size_t k = 0; k < 2; ++k)
      z[static_cast<Index>(k)] =
          static_cast<double>(action[k] - mean[k]) / std::exp(static_cast<double>(log_std[k]));
    sum += z;
    squares += z.square();
    product += z[0] * z[1];
  }
  for (Index k = 0; k < 2; ++k) {
    EXPECT_NEAR(sum[k] / n, 0, 5 * std::sqrt(1.0 / n));
    EXPECT_NEAR(squares[k] / n, 1, 5 * std::sqrt(2.0 / n));
  }
  EXPECT_NEAR(product / n, 0, 5 * std::sqrt(1.0 / n));
  std::array<float, 2> mode{};
  normal.mode(mean.data(), mode.data());
  EXPECT_EQ(mode, mean);
}

}  // namespace
}  // namespace agail
