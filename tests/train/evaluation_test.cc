#include "agail/train/evaluation.h"

#include <cmath>

#include "agail/base/interrupt.h"
#include "base/messages.h"
#include "train/plain_policy.h"

namespace agail {
namespace {

using testing::HasSubstr;

SavedPolicy cartpole_policy(int actions = 2) {
  return plain_policy({"CartPole-v1", "trpo", 0, "", {}}, 4,
                      {.discrete = true, .dim = 1, .n = actions, .low = {}, .high = {}});
}

// The interval of the mean of many values is that of the normal distribution, also where resampling
// takes more numbers than one stream has.
TEST(BootstrapInterval, OfManyValues) {
  for (const std::size_t n : {2'000UL, 7'000UL}) {
    RandomStream random(1, Purpose::kDiagnostics);
    std::vector<double> values(n);
    Evaluation evaluation;
    for (double& value : values) value = 5 + 2 * random.normal();
    evaluation.returns = values;
    const auto [low, high] = bootstrap_interval(values, 3);
    EXPECT_NEAR(low, evaluation.mean_return() - 1.96 * evaluation.standard_error(), 0.005);
    EXPECT_NEAR(high, evaluation.mean_return() + 1.96 * evaluation.standard_error(), 0.005);
    EXPECT_NEAR(evaluation.standard_error(), 2 / std::sqrt(static_cast<double>(n)), 0.005);
  }
}

TEST(Evaluate, StopsOnASignalOnlyWhereItIsToldTo) {
  const SavedPolicy policy = cartpole_policy();
  ThreadPool pool(2);
  const InterruptGuard guard;
  std::raise(SIGTERM);
  try {
    evaluate(policy, 5, 0, false, pool, true);
    FAIL();
  } catch (const EpisodesInterrupted& end) {
    EXPECT_EQ(end.signal, SIGTERM);
  }
  EXPECT_THROW(record(policy, 5, 0, false, pool, true), EpisodesInterrupted);
  // A run's own evaluation is a whole one, whatever was noted.
  for (const double length : evaluate(policy, 5, 0, false, pool).lengths) EXPECT_GT(length, 0);
  EXPECT_EQ(record(policy, 5, 0, false, pool).episodes.size(), 5U);
}

// Fails in the first step.
class Failing final : public Environment {
 public:
  explicit Failing(int& steps) : Environment(make_spec()), steps_(steps) {}
  static EnvironmentSpec make_spec() {
    EnvironmentSpec spec;
    spec.id = "Failing-v0";
    spec.observation_dim = 1;
    spec.action = {.discrete = true, .dim = 1, .n = 2, .low = {}, .high = {}};
    return spec;
  }
  std::span<const double> observation() const override { return {&zero_, 1}; }

 protected:
  void do_reset(RandomStream&) override {}
  StepResult do_step(std::span<const float>) override {
    ++steps_;
    throw InputError("it is broken");
  }
  std::vector<double> do_save() const override { return {}; }
  void do_restore(std::span<const double>) override {}

 private:
  int& steps_;
  double zero_ = 0;
};

class FailingSource final : public EnvironmentSource {
 public:
  std::unique_ptr<Environment> make(const std::string&) override {
    return std::make_unique<Failing>(steps);
  }
  std::optional<EnvironmentSpec> spec(const std::string&) override { return Failing::make_spec(); }

  int steps = 0;
};

TEST(Evaluate, AsksABrokenEnvironmentOnce) {
  FailingSource source;
  const EnvironmentScope scope(source);
  const EnvironmentSpec spec = Failing::make_spec();
  const SavedPolicy policy = plain_policy({spec.id, "trpo", 0, "", {}}, 1, spec.action);
  ThreadPool pool(1);
  EXPECT_EQ(input_error([&] { evaluate(policy, 1000, 0, false, pool); }), "it is broken");
  EXPECT_EQ(source.steps, 1);
}

TEST(Evaluate, TellsInWhatAPolicyDoesNotFit) {
  ThreadPool pool(1);
  EXPECT_THAT(input_error([&] { evaluate(cartpole_policy(3), 1, 0, false, pool); }),
              HasSubstr("it was trained with 4 observations and 3 discrete actions, the "
                        "environment has 4 observations and 2 discrete actions"));
}

}  // namespace
}  // namespace agail
