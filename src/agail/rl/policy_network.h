// The policy's function: an MLP and a distribution over its outputs. Parameters: those of the MLP,
// then log_std.
#pragma once

#include "agail/config/settings.h"
#include "agail/nn/distribution.h"
#include "agail/nn/mlp.h"

namespace agail {

template <class S>
struct PolicyNetwork {
  PolicyNetwork(int observation_dim, const Sizes& hidden, const ActionSpace& action)
      : distribution(action),
        mlp(layer_sizes(observation_dim, hidden, distribution.outputs()), Activation::kTanh) {}

  Index parameters() const { return mlp.parameters() + distribution.log_stds(); }
  const S* log_std(const S* theta) const { return theta + mlp.parameters(); }
  S* log_std(S* theta) const { return theta + mlp.parameters(); }

  // The last layer starts small, so that the first actions are centred and the trust region means
  // something.
  void initialise(S* theta, RandomStream& random, double initial_log_std) const {
    mlp.initialise(theta, random, 0.01);
    std::fill_n(log_std(theta), distribution.log_stds(), static_cast<S>(initial_log_std));
  }

  ActionDistribution<S> distribution;
  Mlp<S> mlp;
};

}  // namespace agail
