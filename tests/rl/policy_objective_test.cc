#include "agail/rl/policy_objective.h"

#include <gtest/gtest.h>

#include "rl/support.h"

namespace agail {
namespace {

using reference::numbers;
using reference::relative_error;

constexpr Index kSamples = 150;  // two chunks and a part of one
constexpr int kObservations = 4;

// True: discrete actions.
class PolicyObjectiveTest : public testing::TestWithParam<bool> {
 protected:
  PolicyObjectiveTest()
      : space_(GetParam() ? discrete_actions(3) : continuous_actions(3)),
        network_(kObservations, {6, 5}, space_),
        theta_(reference::normal_vector(network_.parameters(), 1, 0.5)),
        x_(reference::network_input(kObservations, kSamples + 7, 2)),
        actions_(random_actions(space_, kSamples + 7, 3)),
        advantages_(reference::normal_vector(kSamples + 7, 4)) {}

  template <class T>
  reference::Numbers<T> output(const T* theta, Index j) const {
    return reference::mlp(network_.mlp.sizes(), Activation::kTanh, theta,
                          reference::convert<T>(numbers(x_.col(j).head(kObservations))));
  }
  template <class T>
  T surrogate(const reference::Numbers<T>& theta, double entropy_weight) const {
    const T* log_std = theta.data() + network_.mlp.parameters();
    const double* old_log_std = theta_.data() + network_.mlp.parameters();
    const reference::Numbers<double> all(space_.discrete ? 1 : 3, 1.0);
    T sum(0.0);
    for (Index j = 0; j < kSamples; ++j) {
      const auto action = numbers(actions_.col(j));
      const auto out = output(theta.data(), j);
      const T log_p = reference::log_prob(space_.discrete, out, log_std, action, all);
      const double old_log_p =
          reference::log_prob(space_.discrete, output(theta_.data(), j), old_log_std, action, all);
      sum = sum + reference::exponential(log_p - T(old_log_p)) * T(advantages_[j]) +
            T(entropy_weight) * reference::entropy(space_.discrete, out, log_std);
    }
    return sum / T(static_cast<double>(kSamples));
  }
  // Mean over every stride-th sample.
  template <class T>
  T kl(const reference::Numbers<T>& theta, Index stride) const {
    T sum(0.0);
    double count = 0;
    for (Index j = 0; j < kSamples; j += stride, ++count)
      sum = sum + reference::kl(space_.discrete, output(theta_.data(), j),
                                theta_.data() + network_.mlp.parameters(), output(theta.data(), j),
                                theta.data() + network_.mlp.parameters());
    return sum / T(count);
  }

  ActionSpace space_;
  PolicyNetwork<double> network_;
  Vector<double> theta_;
  Matrix<double> x_, actions_;
  Vector<double> advantages_;
};

TEST_P(PolicyObjectiveTest, ValuesEqualTheReference) {
  ThreadPool pool(1);
  PolicyObjective<double> objective(network_, pool, kSamples + 50, 1);
  objective.bind(theta_, x_, actions_, advantages_, kSamples, 0.3);
  const Vector<double> other = theta_ + reference::normal_vector(network_.parameters(), 5, 0.1);
  const auto value = objective.evaluate(other);
  EXPECT_NEAR(value.surrogate, surrogate(numbers(other), 0.3), 1e-12);
  EXPECT_NEAR(value.kl, kl(numbers(other), 1), 1e-12);
  EXPECT_NEAR(0.3 * value.entropy, surrogate(numbers(other), 0.3) - surrogate(numbers(other), 0),
              1e-12);
  EXPECT_NEAR(objective.evaluate(theta_).kl, 0, 1e-15);
}

TEST_P(PolicyObjectiveTest, ValuesAtTheOldParametersNeedNoPass) {
  ThreadPool pool(1);
  PolicyObjective<double> objective(network_, pool, kSamples, 1);
  objective.bind(theta_, x_, actions_, advantages_, kSamples, 0.3);
  const auto kept = objective.evaluate_old();
  const auto computed = objective.evaluate(theta_);
  EXPECT_EQ(kept.surrogate, computed.surrogate);
  EXPECT_EQ(kept.entropy, computed.entropy);
  EXPECT_EQ(kept.kl, 0);
  EXPECT_NEAR(computed.kl, 0, 1e-15);
}

TEST_P(PolicyObjectiveTest, GradientOfTheSurrogate) {
  ThreadPool pool(1);
  for (const double entropy_weight : {0.0, 0.3}) {
    PolicyObjective<double> objective(network_, pool, kSamples, 5);
    objective.bind(theta_, x_, actions_, advantages_, kSamples, entropy_weight);
    const Vector<double> gradient = objective.gradient();
    const auto f = [&](const auto& theta) { return surrogate(theta, entropy_weight); };
    EXPECT_LE(relative_error(gradient, reference::gradient(f, theta_)), 1e-12);
    const auto value = [&](const Vector<double>& theta) {
      return objective.evaluate(theta).surrogate;
    };
    EXPECT_LE(relative_error(gradient, reference::differences(value, theta_)), 1e-7);
  }
}

TEST_P(PolicyObjectiveTest, FisherVectorProductIsTheHessianOfTheKl) {
  ThreadPool pool(1);
  const Vector<double> v = reference::normal_vector(network_.parameters(), 6);
  for (const int stride : {1, 4}) {
    PolicyObjective<double> objective(network_, pool, kSamples, stride);
    objective.bind(theta_, x_, actions_, advantages_, kSamples, 0);
    Vector<double> product = Vector<double>::Zero(v.size());
    objective.fisher_vector_product(v, product);
    const auto f = [&](const auto& theta) { return kl(theta, stride); };
    EXPECT_LE(relative_error(product, reference::hessian_vector_product(f, theta_, v)), 1e-12);
    if (stride != 1) continue;
    // d^2 KL / dv de_k, differences of differences at two distances that cancel the h^2 term.
    const auto second = [&](Index k, double h) {
      Vector<double> a = theta_ + h * v, b = theta_ - h * v, c = a, d = b;
      a[k] += h;
      b[k] += h;
      c[k] -= h;
      d[k] -= h;
      return (objective.evaluate(a).kl - objective.evaluate(b).kl - objective.evaluate(c).kl +
              objective.evaluate(d).kl) /
             (4 * h * h);
    };
    Vector<double> expected(v.size());
    for (Index k = 0; k < v.size(); ++k) expected[k] = (4 * second(k, 1e-3) - second(k, 2e-3)) / 3;
    EXPECT_LE(relative_error(product, expected), 1e-6);
  }
}

TEST_P(PolicyObjectiveTest, SameBitsForAnyNumberOfThreads) {
  const PolicyNetwork<float> network(kObservations, {6, 5}, space_);
  const Vector<float> theta = theta_.cast<float>(), advantages = advantages_.cast<float>();
  const Matrix<float> x = x_.cast<float>(), actions = actions_.cast<float>();
  Vector<float> gradient, product(theta.size());
  double surrogate = 0, kl = 0;
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    PolicyObjective<float> objective(network, pool, kSamples, 1);
    objective.bind(theta, x, actions, advantages, kSamples, 0.1F);
    const Vector<float> g = objective.gradient();
    Vector<float> f(theta.size());
    objective.fisher_vector_product(g, f);
    const auto value = objective.evaluate(theta + 0.01F * g);
    if (threads == 1) {
      gradient = g;
      product = f;
      surrogate = value.surrogate;
      kl = value.kl;
    }
    EXPECT_TRUE(reference::same_bits(g, gradient));
    EXPECT_TRUE(reference::same_bits(f, product));
    EXPECT_EQ(value.surrogate, surrogate);
    EXPECT_EQ(value.kl, kl);
  }
}

INSTANTIATE_TEST_SUITE_P(Actions, PolicyObjectiveTest, testing::Bool());

}  // namespace
}  // namespace agail
