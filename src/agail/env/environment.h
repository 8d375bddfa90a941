// What every environment is: Gymnasium's semantics, with the time limit inside.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "agail/base/random.h"
#include "agail/base/spaces.h"

namespace agail {

struct EnvironmentSpec {
  std::string id;  // Gymnasium's, e.g. "Hopper-v5"
  int observation_dim = 0;
  bool observation_is_float32 = false;  // Gymnasium's dtype; values are handed out as double
  ActionSpace action;
  int max_episode_steps = 0;  // 0: the environment itself tells when an episode is truncated
  // How its own observations and actions differ from these, where its source tells: kept with
  // policies (PolicyInfo::layout).
  std::map<std::string, std::vector<std::int64_t>> layout{};
};

struct StepResult {
  double reward = 0;
  bool terminated = false;  // the task ended: no value beyond this state
  bool truncated = false;   // the time limit ended it: bootstrap from the value of this state
  bool diverged =
      false;  // the simulation broke down; also terminated, reward 0, last finite observation kept
};

class Environment {
 public:
  virtual ~Environment() = default;

  const EnvironmentSpec& spec() const { return spec_; }
  int elapsed_steps() const { return elapsed_; }

  // Starts an episode.
  void reset(RandomStream& random);

  // One step. `action`: spec().action.dim floats (discrete: one, the index), not clipped by us; as
  // in Gymnasium.
  StepResult step(std::span<const float> action);

  // spec().observation_dim values, of the current state.
  virtual std::span<const double> observation() const = 0;

  // The whole state, elapsed steps included: an environment restored from it continues bit for bit.
  // Empty if the environment cannot save its state; then its episode cannot be continued.
  std::vector<double> save() const;
  // Throws InputError if `state` is not of this environment's size.
  void restore(std::span<const double> state);

 protected:
  explicit Environment(EnvironmentSpec spec) : spec_(std::move(spec)) {}
  virtual void do_reset(RandomStream& random) = 0;
  // `truncated` only for endings other than spec().max_episode_steps.
  virtual StepResult do_step(std::span<const float> action) = 0;
  virtual bool can_save() const { return true; }
  virtual std::vector<double> do_save() const = 0;
  virtual void do_restore(std::span<const double> state) = 0;

 private:
  EnvironmentSpec spec_;
  int elapsed_ = 0;
};

// Built-in ids, in the order of `agail envs`.
std::vector<std::string> environment_ids();

// Throws InputError, naming the nearest id, if `id` is unknown. Models are compiled once a process
// and shared.
std::unique_ptr<Environment> make_environment(const std::string& id);

// Version of the physics library, e.g. "4.0.0".
std::string physics_version();

// "11 observations and 3 continuous action dimensions", for messages.
std::string sizes_in_words(int observations, const ActionSpace& action);

// The spec without building an environment.
EnvironmentSpec environment_spec(const std::string& id);
// None if `id` is unknown.
std::optional<EnvironmentSpec> find_environment_spec(const std::string& id);

// Where environments come from that are not built in.
class EnvironmentSource {
 public:
  virtual ~EnvironmentSource() = default;
  // Null: not an id of this source.
  virtual std::unique_ptr<Environment> make(const std::string& id) = 0;
  // None: not an id of this source.
  virtual std::optional<EnvironmentSpec> spec(const std::string& id) = 0;
};

// While it lives, make_environment() and environment_spec() on this thread ask `source` first, the
// newest of several alone. Environments may outlive it.
class EnvironmentScope {
 public:
  explicit EnvironmentScope(EnvironmentSource& source);
  ~EnvironmentScope();
  EnvironmentScope(const EnvironmentScope&) = delete;
  EnvironmentScope& operator=(const EnvironmentScope&) = delete;

 private:
  EnvironmentSource* previous_;
};

}  // namespace agail
