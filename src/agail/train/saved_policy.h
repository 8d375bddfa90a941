// A policy as people keep it: one safetensors file that says for which environment it is, how it
// was made, and acts.
//
// Tensors: policy.<l>.weight (out x in), policy.<l>.bias, policy.log_std (continuous actions), and,
// if observations are normalised, observation.mean and observation.std. The mean action is
//   x = clip((s - mean) / std, +-clip);  x = tanh(W x + b) for each hidden layer;  a = W x + b
//   (discrete: argmax).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "agail/base/archive.h"
#include "agail/env/environment.h"
#include "agail/nn/normalizer.h"
#include "agail/rl/policy_network.h"

namespace agail {

struct PolicyInfo {
  std::string environment;
  std::string method;
  std::int64_t timesteps = 0;                        // of interaction that it learned from
  std::string settings;                              // TOML
  std::optional<double> demonstrations_mean_return;  // undiscounted, if the demonstrations told it
  // Where the environment's own observations and actions are not as a policy has them, numbers in a
  // row and counted from 0: its shapes and starts, as python/agail/_layout.py names them.
  std::map<std::string, std::vector<std::int64_t>> layout{};
};

class SavedPolicy {
 public:
  SavedPolicy(PolicyInfo info, int observation_dim, const ActionSpace& action, const Sizes& hidden,
              const Normalizer& normalizer, Vector<double> standard_deviation, Vector<float> theta);

  // InputError, one line, for anything that is not such a file.
  static SavedPolicy load(const std::filesystem::path& file);
  // From the bytes of such a file, named `where` in messages.
  static SavedPolicy decode(std::span<const std::uint8_t> bytes, const std::string& where);
  TensorStore store() const;
  std::vector<std::uint8_t> encode() const;
  void save(const std::filesystem::path& file) const;

  const PolicyInfo& info() const { return info_; }
  const ActionSpace& action() const { return action_; }
  int observation_dim() const { return observation_dim_; }
  const Sizes& hidden() const { return hidden_; }
  const PolicyNetwork<float>& network() const { return network_; }
  const Vector<float>& theta() const { return theta_; }
  // CRC-32C of the parameters in 8 hex digits: equal runs have equal ones.
  std::string signature() const;

  // Space for one caller; policies are shared between threads, these are not.
  struct Workspace {
    Matrix<float> input;
    Tape<float> tape;
    std::vector<float> observation;
  };
  Workspace make_workspace() const;

  // The action for one observation (observation_dim values), within the bounds: the mode, or a
  // sample if `random` is given. action: action().dim values.
  void act(std::span<const double> observation, RandomStream* random, Workspace& workspace,
           float* action) const;

 private:
  PolicyInfo info_;
  int observation_dim_;
  ActionSpace action_;
  Sizes hidden_;
  Normalizer normalizer_;
  Vector<double>
      standard_deviation_;  // that the normaliser was set to: its own may round otherwise
  PolicyNetwork<float> network_;
  Vector<float> theta_;
};

// POLICY on the command line: a .safetensors file, or a run folder: there the best-evaluated policy
// for trpo, the last one for every other method.
std::filesystem::path policy_file(const std::filesystem::path& policy);

}  // namespace agail
