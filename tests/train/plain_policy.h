// A policy that nobody trained: all its parameters are 0.
#pragma once

#include <utility>

#include "agail/train/saved_policy.h"

namespace agail {

inline SavedPolicy plain_policy(PolicyInfo info, int observation_dim, const ActionSpace& action,
                                bool normalizes = false) {
  const Sizes hidden = {4};
  const PolicyNetwork<float> network(observation_dim, hidden, action);
  return {std::move(info),
          observation_dim,
          action,
          hidden,
          Normalizer(observation_dim, normalizes, 5),
          Vector<double>::Ones(observation_dim),
          Vector<float>::Zero(network.parameters())};
}

}  // namespace agail
