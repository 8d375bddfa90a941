// Environments that are not built in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "agail/base/error.h"
#include "agail/env/environment.h"

namespace agail {
namespace {

// Counts its steps; says itself after how many it is truncated.
class Counter final : public Environment {
 public:
  Counter(const std::string& id, double end)
      : Environment({.id = id,
                     .observation_dim = 1,
                     .observation_is_float32 = false,
                     .action = {.discrete = false, .dim = 1, .n = 0, .low = {-1}, .high = {1}},
                     .max_episode_steps = 0}),
        end_(end) {}
  std::span<const double> observation() const override { return {&steps_, 1}; }

 protected:
  void do_reset(RandomStream&) override { steps_ = 0; }
  StepResult do_step(std::span<const float>) override {
    ++steps_;
    StepResult result;
    result.truncated = steps_ == end_;
    return result;
  }
  bool can_save() const override { return false; }
  std::vector<double> do_save() const override { return {}; }
  void do_restore(std::span<const double>) override {}

 private:
  double end_, steps_ = 0;
};

class Counters final : public EnvironmentSource {
 public:
  explicit Counters(std::string id, double end = 3) : id_(std::move(id)), end_(end) {}
  std::unique_ptr<Environment> make(const std::string& id) override {
    return id == id_ ? std::make_unique<Counter>(id, end_) : nullptr;
  }
  std::optional<EnvironmentSpec> spec(const std::string& id) override {
    if (id != id_) return std::nullopt;
    return make(id)->spec();
  }

 private:
  std::string id_;
  double end_;
};

TEST(EnvironmentSource, IsAskedFirstWhileItsScopeLives) {
  Counters counters("Counter-v0"), hoppers("Hopper-v5", 5);
  {
    const EnvironmentScope scope(counters);
    EXPECT_EQ(make_environment("Counter-v0")->spec().observation_dim, 1);
    EXPECT_EQ(environment_spec("Hopper-v5").observation_dim, 11);
    {
      const EnvironmentScope inner(hoppers);
      EXPECT_EQ(environment_spec("Hopper-v5").observation_dim, 1);
      EXPECT_FALSE(find_environment_spec("Counter-v0"));
    }
    EXPECT_EQ(environment_spec("Hopper-v5").observation_dim, 11);
    std::thread([] { EXPECT_FALSE(find_environment_spec("Counter-v0")); }).join();
  }
  EXPECT_THROW(make_environment("Counter-v0"), InputError);
}

TEST(EnvironmentSource, TruncatesByItself) {
  Counters counters("Counter-v0");
  const EnvironmentScope scope(counters);
  const auto environment = make_environment("Counter-v0");
  RandomStream random(0, Purpose::kReset);
  environment->reset(random);
  const std::vector<float> action = {0};
  EXPECT_FALSE(environment->step(action).truncated);
  EXPECT_FALSE(environment->step(action).truncated);
  EXPECT_TRUE(environment->step(action).truncated);
}

TEST(EnvironmentSource, SavesNothingWhereThatIsImpossible) {
  Counter counter("Counter-v0", 3);
  EXPECT_TRUE(counter.save().empty());
}

}  // namespace
}  // namespace agail
