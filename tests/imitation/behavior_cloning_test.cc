#include "agail/imitation/behavior_cloning.h"

#include <gtest/gtest.h>

#include "imitation/support.h"

namespace agail {
namespace {

constexpr Index kSamples = 2000;

// a = K s + b + noise, with noise of deviation 0.1 in the second dimension.
Demonstrations linear_policy() {
  Matrix<double> k(2, 3);
  k << 0.5, -1, 0.2, 0, 0.7, -0.4;
  const Matrix<double> states = reference::normal_matrix(3, kSamples + 1, 1);
  Matrix<double> actions = k * states.leftCols(kSamples);
  actions.row(0).array() += 0.3;
  actions.row(1) += reference::normal_matrix(1, kSamples, 2, 0.1);
  return demonstrations_from(states, actions, continuous_actions(2));
}

TEST(BehaviorCloning, FitsALinearPolicy) {
  Demonstrations demonstrations = linear_policy();
  remove_actions(demonstrations,
                 {.pattern = MaskPattern::kStep, .ratio = 0.3, .seed = 2, .dimension = {}});
  const DemoData demos(demonstrations);
  const DemoData truth(linear_policy());
  ThreadPool pool(1);
  const PolicyNetwork<float> network(3, {32}, demonstrations.action);
  Normalizer normalizer(3, true, 5);
  normalizer.update(pool, demos.states);
  Vector<float> theta(network.parameters());
  RandomStream random(1, Purpose::kInitialise);
  network.initialise(theta.data(), random, 0);
  BcSettings settings;
  settings.epochs = 300;
  settings.minibatch = 64;
  const RegressionReport report =
      clone_policy(network, normalizer, demos, {demos.actions, demos.available, demos.some_action},
                   settings, true, pool, 1, theta);
  EXPECT_GT(report.quality, 0.98);
  EXPECT_LE(report.best_epoch, report.epochs);
  EXPECT_NEAR(report.validation_loss, 0.5 * 0.01, 0.002);

  Matrix<float> x = Matrix<float>::Zero(padded(4), kSamples);
  normalizer.apply(pool, demos.states, kSamples, x);
  Tape<float> tape = network.mlp.make_tape(kSamples);
  network.mlp.forward(theta.data(), x.topRows(4), tape, 0);
  const Matrix<double> error =
      (network.mlp.output(tape, 0, kSamples) - truth.actions).cast<double>();
  EXPECT_LE(std::sqrt(error.row(0).squaredNorm() / kSamples), 0.05);
  EXPECT_NEAR(std::sqrt(error.row(1).squaredNorm() / kSamples), 0.1, 0.02);
  EXPECT_NEAR(network.log_std(theta.data())[1], std::log(0.1), 0.1);
  EXPECT_LE(network.log_std(theta.data())[0], std::log(0.05));
  EXPECT_GE(network.log_std(theta.data())[0], -3);
}

TEST(BehaviorCloning, TellsDivergenceAndWhatWasNotMeasured) {
  const DemoData demos(linear_policy());
  ThreadPool pool(1);
  const PolicyNetwork<float> network(3, {8}, continuous_actions(2));
  const Normalizer normalizer(3, false, 5);
  const auto clone = [&](double learning_rate, double validation_share) {
    Vector<float> theta = Vector<float>::Constant(network.parameters(), 0.1F);
    BcSettings settings;
    settings.epochs = 2;
    settings.learning_rate = learning_rate;
    settings.validation_share = validation_share;
    return clone_policy(network, normalizer, demos,
                        {demos.actions, demos.available, demos.some_action}, settings, true, pool,
                        1, theta);
  };
  EXPECT_THROW(clone(1e38, 0.1), InputError);
  EXPECT_THROW(clone(1e38, 0), InputError);
  const RegressionReport report = clone(1e-3, 0);
  EXPECT_EQ(report.best_epoch, 2);
  EXPECT_TRUE(std::isnan(report.quality));
  EXPECT_TRUE(std::isnan(report.validation_loss));
}

TEST(BehaviorCloning, SameBitsForAnyNumberOfThreads) {
  const DemoData demos(linear_policy());
  Vector<float> first;
  for (const int threads : {1, 2, 3}) {
    ThreadPool pool(threads);
    const PolicyNetwork<float> network(3, {8}, continuous_actions(2));
    const Normalizer normalizer(3, false, 5);
    Vector<float> theta = Vector<float>::Constant(network.parameters(), 0.1F);
    BcSettings settings;
    settings.epochs = 2;
    clone_policy(network, normalizer, demos, {demos.actions, demos.available, demos.some_action},
                 settings, true, pool, 1, theta);
    if (threads == 1) first = theta;
    EXPECT_TRUE(reference::same_bits(theta, first));
  }
}

// In single precision, as it is used: against the reference on the same numbers.
TEST(CloningTerm, ValueAndGradientOfTheWeightedLogLikelihood) {
  for (const bool discrete : {false, true}) {
    const ActionSpace space = discrete ? discrete_actions(3) : continuous_actions(2);
    const Index n = 4;  // few demonstrations and many draws: the mean over draws is nearly the mean
    const Matrix<double> states = reference::normal_matrix(3, n + 1, 1);
    Demonstrations demonstrations = demonstrations_from(states, random_actions(space, n, 2), space);
    demonstrations.episodes[0].available(1, 0) = 0;
    const DemoData demos(demonstrations);
    const PolicyNetwork<float> network(3, {6}, space);
    const Normalizer normalizer(3, false, 5);
    Vector<float> theta = reference::normal_vector(network.parameters(), 3, 0.5).cast<float>();
    // All draws are of the one column given.
    for (const Index column : {Index{0}, Index{1}, Index{3}}) {
      ThreadPool pool(1);
      CloneSettings settings;
      settings.weight = 0.8;
      settings.decay = 0.5;
      settings.minibatch = 100;
      const CloningTargets targets{demos.actions, demos.available, {column}};
      CloningTerm term(network, normalizer, demos, targets, settings, pool, 1);
      for (const double weight : {0.8, 0.4, 0.2}) {
        term.begin_update(theta);
        const auto f = [&](const auto& at) {
          using T = std::decay_t<decltype(at[0])>;
          const auto x = reference::convert<T>(reference::numbers(demos.states.col(column)));
          return T(weight) *
                 reference::log_prob(
                     discrete, reference::mlp(network.mlp.sizes(), Activation::kTanh, at.data(), x),
                     at.data() + network.mlp.parameters(),
                     reference::numbers(demos.actions.col(column)),
                     reference::numbers(demos.available.col(column)));
        };
        const Vector<double> point = theta.cast<double>();
        EXPECT_NEAR(term.value(theta), f(reference::numbers(point)), 1e-5);
        EXPECT_NEAR(term.log_likelihood(), term.value(theta) / weight, 1e-9);
        const Vector<double> start = reference::normal_vector(theta.size(), 5);
        Vector<float> gradient = start.cast<float>();
        term.add_gradient(theta, gradient);
        const Vector<double> expected = reference::gradient(f, point);
        EXPECT_LE((gradient.cast<double>() - start - expected).cwiseAbs().maxCoeff(), 2e-5);
      }
    }
  }
}

TEST(CloningTerm, TellsTheLikelihoodWhenItsWeightHasGone) {
  const ActionSpace space = continuous_actions(2);
  const Index n = 4;
  const DemoData demos(demonstrations_from(reference::normal_matrix(3, n + 1, 1),
                                           random_actions(space, n, 2), space));
  const PolicyNetwork<float> network(3, {6}, space);
  const Normalizer normalizer(3, false, 5);
  const Vector<float> theta = reference::normal_vector(network.parameters(), 3, 0.5).cast<float>();
  const CloningTargets targets{demos.actions, demos.available, {0, 1, 2, 3}};
  ThreadPool pool(1);
  const auto after_two_updates = [&](double decay) {
    CloningTerm term(network, normalizer, demos, targets,
                     {.weight = 1, .decay = decay, .minibatch = 8}, pool, 1);
    for (int update = 0; update < 2; ++update) term.begin_update(theta);
    return std::pair(term.log_likelihood(), term.value(theta));
  };
  const auto [kept, value] = after_two_updates(1);
  EXPECT_DOUBLE_EQ(value, kept);
  EXPECT_EQ(after_two_updates(0), std::pair(kept, 0.0));
}

}  // namespace
}  // namespace agail
