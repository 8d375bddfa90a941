#include "agail/imitation/inverse_dynamics.h"

#include <gtest/gtest.h>

#include "imitation/support.h"

namespace agail {
namespace {

// s' = A s + B a: the action is a linear function of s and s'.
TEST(InverseDynamics, RecoversTheActionsOfALinearSystem) {
  constexpr Index n = 5000;
  const ActionSpace space = continuous_actions(2, 1);
  RandomStream random(1, Purpose::kRecord);
  Matrix<double> states = Matrix<double>::Zero(3, n + 1), actions(2, n);
  Matrix<double> a(3, 3), b(3, 2);
  a << 0.9, 0.1, 0, -0.1, 0.9, 0, 0, 0.2, 0.7;
  b << 0.3, 0, 0, 0.5, 0.2, -0.2;
  for (Index t = 0; t < n; ++t) {
    for (Index i = 0; i < 2; ++i) actions(i, t) = static_cast<float>(random.uniform(-1, 1));
    states.col(t + 1) = a * states.col(t) + b * actions.col(t);
  }
  Demonstrations demonstrations = demonstrations_from(states, actions, space);
  remove_actions(demonstrations,
                 {.pattern = MaskPattern::kStep, .ratio = 0.7, .seed = 3, .dimension = {}});
  const DemoData demos(demonstrations);
  ThreadPool pool(1);
  InverseDynamicsSettings settings;
  settings.hidden = {32, 32};
  Matrix<float> inferred, available;
  const RegressionReport report =
      infer_missing_actions(demos, space, settings, 5, pool, 1, inferred, available);
  EXPECT_GT(report.quality, 0.99);
  double error = 0, variance = 0;
  Index missing = 0;
  for (Index j = 0; j < n; ++j)
    for (Index i = 0; i < 2; ++i) {
      if (demos.available(i, j) == 1) {
        EXPECT_EQ(inferred(i, j), static_cast<float>(actions(i, j)));
        continue;
      }
      ++missing;
      error += std::pow(static_cast<double>(inferred(i, j)) - actions(i, j), 2);
      variance += std::pow(actions(i, j), 2);
      EXPECT_LE(std::abs(inferred(i, j)), 1);
    }
  EXPECT_EQ(missing, 2 * 3500);
  EXPECT_EQ(available.minCoeff(), 1);
  EXPECT_GT(1 - error / variance, 0.99);
}

TEST(InverseDynamics, LeavesADimensionMissingThatNothingTells) {
  constexpr Index n = 200;
  RandomStream random(1, Purpose::kRecord);
  Matrix<double> states(3, n + 1), actions(2, n);
  for (double& value : states.reshaped()) value = random.normal();
  for (double& value : actions.reshaped()) value = random.uniform(-1, 1);
  const ActionSpace space = continuous_actions(2, 1);
  Demonstrations demonstrations = demonstrations_from(states, actions, space);
  remove_actions(demonstrations,
                 {.pattern = MaskPattern::kDimension, .ratio = 0.5, .seed = 3, .dimension = 1});
  remove_actions(demonstrations,
                 {.pattern = MaskPattern::kStep, .ratio = 0.5, .seed = 3, .dimension = {}});
  const DemoData demos(demonstrations);
  ThreadPool pool(1);
  Matrix<float> inferred, available;
  infer_missing_actions(demos, space, {.hidden = {8}, .epochs = 3}, 5, pool, 1, inferred,
                        available);
  EXPECT_EQ(available.row(0).minCoeff(), 1);
  EXPECT_EQ(available.row(1).maxCoeff(), 0);
  EXPECT_EQ(inferred.row(1).cwiseAbs().maxCoeff(), 0);
}

TEST(InverseDynamics, RecoversDiscreteActions) {
  constexpr Index n = 1500;
  const ActionSpace space = discrete_actions(3);
  RandomStream random(1, Purpose::kRecord);
  Matrix<double> states = Matrix<double>::Zero(2, n + 1), actions(1, n);
  for (Index t = 0; t < n; ++t) {
    actions(0, t) = random.below(3);
    states(0, t + 1) = 0.9 * states(0, t) + (actions(0, t) - 1);
    states(1, t + 1) = 0.5 * states(1, t) + (actions(0, t) == 1 ? 1 : -0.5);
  }
  Demonstrations demonstrations = demonstrations_from(states, actions, space);
  remove_actions(demonstrations,
                 {.pattern = MaskPattern::kStep, .ratio = 0.5, .seed = 3, .dimension = {}});
  const DemoData demos(demonstrations);
  ThreadPool pool(1);
  Matrix<float> inferred, available;
  const RegressionReport report = infer_missing_actions(
      demos, space, {.hidden = {32}, .epochs = 60}, 5, pool, 1, inferred, available);
  EXPECT_GT(report.quality, 0.99);
  Index wrong = 0;
  for (Index j = 0; j < n; ++j) wrong += static_cast<double>(inferred(0, j)) != actions(0, j);
  EXPECT_LE(wrong, 15);
}

}  // namespace
}  // namespace agail
