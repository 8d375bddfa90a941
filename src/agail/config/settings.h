// Every setting of a training run, as plain data. Names, units, ranges and help texts:
// settings_table.cc.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace agail {

using Sizes = std::vector<std::int64_t>;

// A run as a whole.
struct RunSettings {
  std::int64_t timesteps = 1'000'000;
  std::int64_t batch_steps = 1024;  // of all lanes together
  std::int64_t lanes = 1;
  std::int64_t evaluate_every = 20;  // updates; 0: never
  std::int64_t evaluation_episodes = 10;
  std::int64_t checkpoint_every = 50;  // updates
};

struct PolicySettings {
  Sizes hidden = {100, 100};
  double initial_log_std = 0;
  bool normalize_observations = true;
  double observation_clip = 5;
  bool freeze_normalizer = false;  // statistics of the demonstrated states, which no longer move
};

struct TrpoSettings {
  double gamma = 0.995;
  double lambda = 0.97;
  double max_kl = 0.01;
  std::int64_t cg_iterations = 10;
  double cg_damping = 0.1;
  std::int64_t fisher_stride = 5;
  std::int64_t line_search_halvings = 10;  // candidates, the first is the step itself
  double entropy_weight = 0;
};

struct ValueSettings {
  Sizes hidden = {100, 100};
  std::int64_t epochs = 5;
  double learning_rate = 1e-3;
  std::int64_t minibatch = 128;
  bool normalize_targets = false;
};

struct DiscriminatorSettings {
  Sizes features;  // indices of the observation that it sees; empty: all
  Sizes hidden = {100, 100};
  double learning_rate = 1e-4;
  double entropy_weight = 1e-3;
  double gradient_penalty = 0;
  std::int64_t minibatches = 8;  // an update
  std::int64_t minibatch = 128;  // states of the policy, and as many of the demonstrations
  std::int64_t every = 3;        // policy batches an update of discriminator and guide
  bool normalize_observations = true;
  std::string reward = "softplus";
};

struct GuideSettings {
  std::string target = "random";
  std::string reward = "likelihood";
  std::int64_t hidden = 100;  // units for s, for a, and in the second layer
  double learning_rate = 1e-4;
};

struct RewardSettings {
  double alpha = 1;
  std::optional<double> beta;  // empty: 1 - missing ratio of the demonstrations
  double centring = 0;         // share of the running mean that is subtracted
  double terminal_value = 0;   // value of the state after a termination, imitation only
};

// How the policy of gail and agail starts.
struct StartSettings {
  std::string method = "random";
  double log_std = -1;            // of a cloned policy's continuous actions
  std::int64_t value_warmup = 0;  // batches in which the policy does not move
};

// The cloning term of the policy's objective.
struct CloneSettings {
  double weight = 0;
  double decay = 1;  // per update
  std::int64_t minibatch = 512;
};

// Behaviour cloning: methods bc and bco, and the start of the others.
struct BcSettings {
  std::int64_t epochs = 200;
  double learning_rate = 1e-3;
  std::int64_t minibatch = 128;
  double validation_share = 0.1;
};

struct InverseDynamicsSettings {
  Sizes hidden = {100, 100};
  std::int64_t epochs = 200;
  double learning_rate = 1e-3;
};

// Behaviour cloning from observation: rounds of collecting, inverse dynamics and cloning.
struct BcoSettings {
  std::int64_t every = 5;        // policy batches a round
  std::int64_t buffer = 20'000;  // own transitions that inverse dynamics learns from
  std::int64_t epochs = 20;      // of a round, for inverse dynamics and for cloning each
};

struct Settings {
  RunSettings run;
  PolicySettings policy;
  TrpoSettings trpo;
  ValueSettings value;
  DiscriminatorSettings discriminator;
  GuideSettings guide;
  RewardSettings reward;
  StartSettings start;
  CloneSettings clone;
  BcSettings bc;
  InverseDynamicsSettings inverse_dynamics;
  BcoSettings bco;
};

}  // namespace agail
