#include "agail/env/cartpole.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace agail {
namespace {

TEST(CartPole, OneStepWorkedOutByHand) {
  CartPole env("CartPole-v1", 500);
  // Upright and at rest: sin 0 = 0, cos 0 = 1. push = 10 / 1.1; the angular acceleration is
  // -push / (0.5 (4/3 - 0.1 / 1.1)), the cart's push - 0.05 * angular / 1.1; positions follow a
  // step later.
  env.restore(std::vector<double>{0, 0, 0, 0, 0, 0});
  const StepResult result = env.step(std::vector<float>{1.0F});
  const double push = 10.0 / 1.1;
  const double angular = -push / (0.5 * (4.0 / 3.0 - 0.1 / 1.1));
  EXPECT_EQ(result.reward, 1.0);
  EXPECT_FALSE(result.terminated);
  EXPECT_EQ(env.observation()[0], 0.0);
  EXPECT_FLOAT_EQ(static_cast<float>(env.observation()[1]),
                  static_cast<float>(0.02 * (push - 0.05 * angular / 1.1)));
  EXPECT_EQ(env.observation()[2], 0.0);
  EXPECT_FLOAT_EQ(static_cast<float>(env.observation()[3]), static_cast<float>(0.02 * angular));
}

TEST(CartPole, ObservationsAreFloat32TheStateIsNot) {
  CartPole env("CartPole-v0", 200);
  RandomStream random(3, Purpose::kReset);
  env.reset(random);
  const std::vector<double> state = env.save();
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(env.observation()[i], static_cast<double>(static_cast<float>(state[1 + i])));
    EXPECT_NE(env.observation()[i], state[1 + i]);
    EXPECT_LE(std::abs(state[1 + i]), 0.05);
  }
}

TEST(CartPole, EndsBeyondTheLimitsAndThenPaysNothing) {
  for (const std::vector<double>& start :
       {std::vector<double>{0, 2.39, 1, 0, 0, 0}, std::vector<double>{0, 0, 0, -0.209, -1, 0}}) {
    CartPole env("CartPole-v1", 500);
    env.restore(start);
    const StepResult ending = env.step(std::vector<float>{1.0F});
    EXPECT_TRUE(ending.terminated);
    EXPECT_EQ(ending.reward, 1.0);
    EXPECT_EQ(env.step(std::vector<float>{1.0F}).reward, 0.0);
  }
}

TEST(CartPole, BrokenStateDiverges) {
  CartPole env("CartPole-v1", 500);
  env.restore(std::vector<double>{0, 0.5, 0, 0, 0, 0});
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    env.restore(std::vector<double>{0, 0, 0, 0, bad, 0});
    const StepResult result = env.step(std::vector<float>{0.0F});
    EXPECT_TRUE(result.diverged);
    EXPECT_TRUE(result.terminated);
    EXPECT_EQ(result.reward, 0.0);
    for (const double value : env.observation()) EXPECT_TRUE(std::isfinite(value));
  }
}

}  // namespace
}  // namespace agail
