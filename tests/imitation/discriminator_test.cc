#include "agail/imitation/discriminator.h"

#include <gtest/gtest.h>

#include <numeric>

#include "imitation/support.h"

namespace agail {
namespace {

using reference::numbers;
using reference::relative_error;

struct Case {
  Index minibatch;
  double entropy_weight, gradient_penalty;
};

class DiscriminatorLossTest : public testing::TestWithParam<Case> {
 protected:
  static constexpr int kInputs = 4;
  DiscriminatorLossTest()
      : mlp_({kInputs, 6, 5, 1}, Activation::kTanh),
        theta_(reference::normal_vector(mlp_.parameters(), 1, 0.6)),
        x_(reference::network_input(kInputs, 2 * GetParam().minibatch, 2)),
        between_(reference::network_input(kInputs, GetParam().minibatch, 3)) {
    settings_.minibatch = GetParam().minibatch;
    settings_.entropy_weight = GetParam().entropy_weight;
    settings_.gradient_penalty = GetParam().gradient_penalty;
  }

  template <class T>
  T output(const reference::Numbers<T>& theta, Index j) const {
    return reference::mlp(mlp_.sizes(), Activation::kTanh, theta.data(),
                          reference::convert<T>(numbers(x_.col(j).head(kInputs))))[0];
  }
  template <class T>
  T penalty(const reference::Numbers<T>& theta) const {
    T sum(0.0);
    for (Index j = 0; j < settings_.minibatch; ++j) {
      const T norm = reference::input_gradient_norm(mlp_.sizes(), Activation::kTanh, theta.data(),
                                                    numbers(between_.col(j).head(kInputs)));
      sum = sum + (norm - T(1.0)) * (norm - T(1.0));
    }
    return T(settings_.gradient_penalty / static_cast<double>(settings_.minibatch)) * sum;
  }
  // As the formula is written: means over the m policy samples, the m demonstrations, all 2 m.
  template <class T>
  T loss(const reference::Numbers<T>& theta) const {
    const Index m = settings_.minibatch;
    T sum(0.0);
    for (Index j = 0; j < 2 * m; ++j) {
      const T p = T(1.0) / (T(1.0) + reference::exponential(T(0.0) - output(theta, j)));
      const T q = T(1.0) - p;
      const T log_p = reference::logarithm(p), log_q = reference::logarithm(q);
      sum = sum - (j < m ? log_q : log_p) +
            T(0.5 * settings_.entropy_weight) * (p * log_p + q * log_q);
    }
    return T(1 / static_cast<double>(m)) * sum +
           (settings_.gradient_penalty > 0 ? penalty(theta) : T(0.0));
  }

  Mlp<double> mlp_;
  DiscriminatorSettings settings_;
  Vector<double> theta_;
  Matrix<double> x_, between_;
};

TEST_P(DiscriminatorLossTest, GradientAndReport) {
  ThreadPool pool(1);
  DiscriminatorLoss<double> loss_object(mlp_, settings_, pool);
  Vector<double> gradient = Vector<double>::Zero(mlp_.parameters());
  const DiscriminatorReport report = loss_object.gradient(theta_, x_, between_, gradient);
  const auto f = [&](const auto& theta) { return loss(theta); };
  EXPECT_NEAR(report.loss, loss(numbers(theta_)), 1e-11);
  EXPECT_LE(relative_error(gradient, reference::gradient(f, theta_)), 1e-10);
  const auto value = [&](const Vector<double>& theta) {
    Vector<double> ignored = gradient;
    return loss_object.gradient(theta, x_, between_, ignored).loss;
  };
  EXPECT_LE(relative_error(gradient, reference::differences(value, theta_)), 1e-7);

  if (settings_.gradient_penalty > 0) {
    EXPECT_NEAR(report.gradient_penalty, penalty(numbers(theta_)), 1e-11);
  }
  double policy = 0, demos = 0;
  for (Index j = 0; j < settings_.minibatch; ++j) {
    policy += output(numbers(theta_), j) < 0 ? 1 : 0;
    demos += output(numbers(theta_), settings_.minibatch + j) > 0 ? 1 : 0;
  }
  EXPECT_NEAR(report.policy_accuracy, policy / static_cast<double>(settings_.minibatch), 1e-12);
  EXPECT_NEAR(report.demo_accuracy, demos / static_cast<double>(settings_.minibatch), 1e-12);
}

TEST_P(DiscriminatorLossTest, SameBitsForAnyNumberOfThreads) {
  const Mlp<float> mlp(mlp_.sizes(), Activation::kTanh);
  const Vector<float> theta = theta_.cast<float>();
  const Matrix<float> x = x_.cast<float>(), between = between_.cast<float>();
  Vector<float> first;
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    DiscriminatorLoss<float> loss_object(mlp, settings_, pool);
    Vector<float> gradient(mlp.parameters());
    loss_object.gradient(theta, x, between, gradient);
    if (threads == 1) first = gradient;
    EXPECT_TRUE(reference::same_bits(gradient, first));
  }
}

INSTANTIATE_TEST_SUITE_P(Losses, DiscriminatorLossTest,
                         testing::Values(Case{64, 0.2, 0.7}, Case{50, 0.2, 0.7}, Case{1, 0.2, 0.7},
                                         Case{100, 1e-3, 10}, Case{130, 0.2, 0}, Case{65, 0, 0.7}));

// d goes to log nu_E / nu_policy where both are tables over a few states.
TEST(Discriminator, LearnsTheLogRatioOfStates) {
  ThreadPool pool(1);
  const std::vector<double> visited{0.5, 0.3, 0.15, 0.05}, demonstrated{0.1, 0.2, 0.3, 0.4};
  const Index n = 2000;
  const auto one_hot = [&](const std::vector<double>& shares) {
    Matrix<float> states = Matrix<float>::Zero(4, n);
    Index column = 0;
    for (std::size_t s = 0; s < 4; ++s)
      for (Index k = 0; k < std::lround(shares[s] * static_cast<double>(n)); ++k)
        states(static_cast<Index>(s), column++) = 1;
    EXPECT_EQ(column, n);
    return states;
  };
  const Matrix<float> policy = one_hot(visited), demos = one_hot(demonstrated);
  const Matrix<float> no_actions = Matrix<float>::Zero(1, n);
  std::vector<Index> columns(n);
  std::iota(columns.begin(), columns.end(), Index{0});
  for (const bool normalize : {false, true}) {
    DiscriminatorSettings settings;
    settings.hidden = {16};
    settings.entropy_weight = 0;
    settings.minibatch = 250;
    settings.learning_rate = 3e-3;
    settings.normalize_observations = normalize;
    settings.reward = "log-odds";
    Discriminator discriminator(4, continuous_actions(1), false, settings, 5, pool, n, 1);
    const Discriminator::Samples from_policy{policy, no_actions, n},
        from_demos{demos, no_actions, n};
    Vector<float> rewards(n);
    Vector<double> mean = Vector<double>::Zero(4);
    constexpr std::uint32_t kUpdates = 200, kAveraged = 100;
    for (std::uint32_t update = 0; update < kUpdates; ++update) {
      discriminator.learn(from_policy, from_demos, columns, update);
      discriminator.rewards(from_policy, rewards);
      if (update < kUpdates - kAveraged) continue;
      for (Index s = 0, column = 0; s < 4; ++s) {
        mean[s] += static_cast<double>(rewards[column]) / kAveraged;
        column += std::lround(visited[static_cast<std::size_t>(s)] * static_cast<double>(n));
      }
    }
    for (Index s = 0; s < 4; ++s) {
      const auto i = static_cast<std::size_t>(s);
      EXPECT_NEAR(mean[s], std::log(demonstrated[i] / visited[i]), 0.08) << "state " << s;
    }
  }
}

// All forms of the reward at one and the same d.
TEST(Discriminator, RewardForms) {
  ThreadPool pool(1);
  const Matrix<float> states = reference::normal_matrix(3, 100, 1, 30).cast<float>();
  const Matrix<float> actions = Matrix<float>::Zero(1, 100);
  const auto rewards = [&](const std::string& form) {
    DiscriminatorSettings settings;
    settings.reward = form;
    settings.normalize_observations = false;
    Discriminator discriminator(3, continuous_actions(1), false, settings, 5, pool, 100, 1);
    Vector<float> result(100);
    discriminator.rewards({states, actions, 100}, result);
    return result;
  };
  const Vector<float> d = rewards("log-odds"), softplus = rewards("softplus"),
                      p = rewards("probability"), log_p = rewards("log-probability");
  EXPECT_GT(d.maxCoeff() - d.minCoeff(), 0.05F);
  for (Index j = 0; j < 100; ++j) {
    const double expected = 1 / (1 + std::exp(-static_cast<double>(d[j])));
    EXPECT_NEAR(p[j], expected, 1e-6);
    EXPECT_NEAR(log_p[j], std::log(expected), 1e-6);
    EXPECT_NEAR(softplus[j], -std::log(1 - expected), 1e-6);
  }
}

TEST(Discriminator, SeesOnlyItsFeatures) {
  ThreadPool pool(1);
  DiscriminatorSettings settings;
  settings.features = {2, 0};
  Matrix<float> states = reference::normal_matrix(4, 200, 1).cast<float>();
  const Matrix<float> demos = reference::normal_matrix(4, 200, 2).cast<float>();
  const Matrix<float> actions = Matrix<float>::Zero(1, 200);
  std::vector<Index> columns(200);
  std::iota(columns.begin(), columns.end(), Index{0});
  const auto learned = [&](float unseen, float seen) {
    Matrix<float> visited = states;
    visited.row(1).array() += unseen;
    visited.row(3).array() *= unseen;
    visited.row(2).array() += seen;
    Discriminator discriminator(4, continuous_actions(1), false, settings, 5, pool, 200, 1);
    discriminator.learn({visited, actions, 200}, {demos, actions, 200}, columns, 0);
    return archived(discriminator);
  };
  EXPECT_TRUE(same_store(learned(0, 0), learned(17, 0)));
  EXPECT_FALSE(same_store(learned(0, 0), learned(0, 0.5F)));
  settings.features = {4};
  EXPECT_THROW(learned(0, 0), InputError);
}

}  // namespace
}  // namespace agail
