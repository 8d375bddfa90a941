// What holds for every built-in environment.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "agail/base/error.h"
#include "env/support.h"

namespace agail {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class EveryEnvironment : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<Environment> env_ = make_environment(GetParam());
};

// Bits, not values: NaN must equal itself and -0 differ from 0.
bool same_bits(std::span<const double> a, std::span<const double> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

// Observations, rewards and flags of `steps` steps, through resets.
std::vector<double> trace(Environment& env, int steps, std::uint64_t seed) {
  RandomStream random(seed, Purpose::kAct);
  std::vector<double> out;
  for (int i = 0; i < steps; ++i) {
    const StepResult result = env.step(random_action(env.spec().action, random));
    out.insert(out.end(), env.observation().begin(), env.observation().end());
    out.insert(out.end(),
               {result.reward, result.terminated ? 1.0 : 0.0, result.truncated ? 1.0 : 0.0});
    if (result.terminated && i % 3 == 0) env.reset(random);  // at times on, past the end
  }
  return out;
}

TEST_P(EveryEnvironment, SpecIsThatOfTheEnvironment) {
  const EnvironmentSpec spec = environment_spec(GetParam());
  EXPECT_EQ(spec.id, GetParam());
  EXPECT_EQ(spec.observation_dim, static_cast<int>(env_->observation().size()));
  EXPECT_EQ(spec.observation_dim, env_->spec().observation_dim);
  EXPECT_EQ(spec.action, env_->spec().action);
  EXPECT_EQ(spec.max_episode_steps, env_->spec().max_episode_steps);
}

TEST_P(EveryEnvironment, RestoredContinuesBitForBit) {
  RandomStream random(1, Purpose::kReset);
  env_->reset(random);
  auto other = make_environment(GetParam());
  for (const int steps : {0, 1, 17, 80}) {
    trace(*env_, steps, 2);
    const std::vector<double> state = env_->save();
    other->restore(state);
    EXPECT_TRUE(same_bits(other->save(), state));
    EXPECT_TRUE(same_bits(other->observation(), env_->observation()));
    EXPECT_EQ(other->elapsed_steps(), env_->elapsed_steps());
    EXPECT_TRUE(same_bits(trace(*env_, 120, 3), trace(*other, 120, 3)))
        << "after " << steps << " steps";
    // The same object, put back after it went elsewhere.
    const std::vector<double> after = env_->save();
    env_->restore(state);
    trace(*env_, 120, 3);
    EXPECT_TRUE(same_bits(env_->save(), after));
  }
}

TEST_P(EveryEnvironment, ResetDependsOnTheStreamAlone) {
  RandomStream first(5, Purpose::kReset);
  env_->reset(first);
  const std::vector<double> fresh = env_->save();
  trace(*env_, 30, 1);
  RandomStream second(5, Purpose::kReset);
  env_->reset(second);
  EXPECT_TRUE(same_bits(env_->save(), fresh));
  EXPECT_EQ(env_->elapsed_steps(), 0);
}

TEST_P(EveryEnvironment, TimeLimitTruncates) {
  RandomStream random(1, Purpose::kReset);
  env_->reset(random);
  std::vector<double> state = env_->save();
  state[0] = env_->spec().max_episode_steps - 2;
  env_->restore(state);
  const std::vector<float> action(static_cast<std::size_t>(env_->spec().action.dim), 0.0F);
  const StepResult before = env_->step(action);
  EXPECT_FALSE(before.truncated);
  const StepResult last = env_->step(action);
  EXPECT_TRUE(last.truncated);
  EXPECT_FALSE(last.terminated);
  env_->reset(random);
  EXPECT_FALSE(env_->step(action).truncated);
}

TEST_P(EveryEnvironment, RefusesStatesOfAnotherSize) {
  std::vector<double> state = env_->save();
  state.pop_back();
  EXPECT_THAT([&] { env_->restore(state); }, ThrowsMessage<InputError>(HasSubstr(GetParam())));
}

INSTANTIATE_TEST_SUITE_P(Env, EveryEnvironment, testing::ValuesIn(environment_ids()),
                         [](const auto& parameter) { return test_name(parameter.param); });

TEST(Registry, NamesTheNearestId) {
  EXPECT_THAT([] { make_environment("Hoper-v5"); },
              ThrowsMessage<InputError>(HasSubstr("Hopper-v5")));
  EXPECT_THAT([] { environment_spec("CartPole-v2"); },
              ThrowsMessage<InputError>(HasSubstr("CartPole-v")));
}

}  // namespace
}  // namespace agail
