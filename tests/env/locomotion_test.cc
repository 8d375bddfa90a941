#include "agail/env/locomotion.h"

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cmath>
#include <limits>

#include "agail/base/error.h"
#include "agail/env/model.h"
#include "agail/env/numpy_sum.h"
#include "env/support.h"

namespace agail {
namespace {

class EveryTask : public testing::TestWithParam<LocomotionTask> {
 protected:
  std::unique_ptr<Environment> env_ = make_locomotion(GetParam());
  std::shared_ptr<const mjModel> model_ = load_model(GetParam().model);

  // A saved state after some steps. Behind the elapsed steps, the progress and MuJoCo's time come
  // qpos and qvel.
  std::vector<double> state_on_the_way() {
    RandomStream random(1, Purpose::kReset);
    env_->reset(random);
    for (int i = 0; i < 5; ++i) env_->step(random_action(env_->spec().action, random));
    return env_->save();
  }
  std::size_t first_position() const { return 3; }
  std::size_t first_velocity() const { return 3 + static_cast<std::size_t>(model_->nq); }
};

TEST_P(EveryTask, BrokenStatesDivergeAndAResetMends) {
  const std::vector<double> good = state_on_the_way();
  const std::vector<double> seen(env_->observation().begin(), env_->observation().end());
  const std::vector<float> action(static_cast<std::size_t>(env_->spec().action.dim), 0.1F);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e12})
    for (const std::size_t where : {first_position() + 1, first_velocity(), first_velocity() + 2}) {
      std::vector<double> state = good;
      state[where] = bad;
      env_->restore(state);
      for (int i = 0; i < 2; ++i) {  // and stays broken
        const StepResult result = env_->step(action);
        EXPECT_TRUE(result.diverged);
        EXPECT_TRUE(result.terminated);
        EXPECT_EQ(result.reward, 0.0);
        EXPECT_EQ(std::vector<double>(env_->observation().begin(), env_->observation().end()),
                  seen);
      }
      RandomStream random(2, Purpose::kReset);
      env_->reset(random);
      EXPECT_FALSE(env_->step(action).diverged);
      env_->restore(good);
      EXPECT_FALSE(env_->step(action).diverged);
    }
}

TEST_P(EveryTask, BrokenActionDivergesOrIsIgnored) {
  const std::vector<double> good = state_on_the_way();
  std::vector<float> action(static_cast<std::size_t>(env_->spec().action.dim), 0.1F);
  action[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(env_->step(action).diverged);  // the control cost is not a number
  for (const double value : env_->observation()) EXPECT_TRUE(std::isfinite(value));
  env_->restore(good);
  action[0] = 0.1F;
  EXPECT_FALSE(env_->step(action).diverged);
}

TEST_P(EveryTask, ResetNoiseIsInItsRange) {
  const LocomotionTask& task = GetParam();
  RandomStream random(4, Purpose::kReset);
  env_->reset(random);
  const std::vector<double> state = env_->save();
  bool moved = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(model_->nq); ++i) {
    const double noise = state[first_position() + i] - model_->qpos0[i];
    EXPECT_LE(std::abs(noise), task.reset_noise * 1.0001);
    moved = moved || noise != 0;
  }
  EXPECT_TRUE(moved);
  for (std::size_t i = 0; i < static_cast<std::size_t>(model_->nv); ++i)
    EXPECT_LE(std::abs(state[first_velocity() + i]),
              task.reset_noise * (task.normal_velocities ? 6 : 1));
}

INSTANTIATE_TEST_SUITE_P(Env, EveryTask, testing::ValuesIn(locomotion_tasks()),
                         [](const auto& parameter) { return test_name(parameter.param.id); });

TEST(Model, IsCompiledOnceAndDoesNotResetItself) {
  const auto model = load_model("hopper");
  EXPECT_EQ(model, load_model("hopper"));
  EXPECT_TRUE(model->opt.disableflags & mjDSBL_AUTORESET);
}

TEST(Model, ErrorsOfMuJoCoAreThrown) {
  const QuietMuJoCo quiet;
  EXPECT_THROW(mju_error("%s", "test"), SystemError);
  EXPECT_NO_THROW(mju_warning("%s", "test"));
}

// Values whose sum depends on the order: 1e16 swallows a lone 1.
TEST(NumpySum, AddsInNumPysOrder) {
  const auto sum = [](const std::vector<double>& v) {
    return numpy_sum<double>(0, v.size(), [&](std::size_t i) { return v[i]; });
  };
  EXPECT_EQ(sum({}), 0.0);
  EXPECT_EQ(sum({1e16, 1, 1}), 1e16);                     // in order: each 1 is lost
  EXPECT_EQ(sum({1e16, 0, 1, 1, 0, 0, 0, 0}), 1e16 + 2);  // pairs: (1e16 + 0) + (1 + 1)
  std::vector<double> ones(300, 1.0);
  EXPECT_EQ(sum(ones), 300.0);
}

}  // namespace
}  // namespace agail
