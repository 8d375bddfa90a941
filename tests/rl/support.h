// Shared by the tests of learning.
#pragma once

#include <limits>

#include "agail/base/archive.h"
#include "agail/base/spaces.h"
#include "agail/rl/policy_network.h"
#include "nn/reference.h"

namespace agail {

inline ActionSpace continuous_actions(int dim,
                                      float bound = std::numeric_limits<float>::infinity()) {
  ActionSpace space;
  space.dim = dim;
  space.low.assign(static_cast<std::size_t>(dim), -bound);
  space.high.assign(static_cast<std::size_t>(dim), bound);
  return space;
}

inline ActionSpace discrete_actions(int n) {
  ActionSpace space;
  space.discrete = true;
  space.dim = 1;
  space.n = n;
  return space;
}

inline Matrix<double> random_actions(const ActionSpace& space, Index n, std::uint64_t seed) {
  Matrix<double> actions = reference::normal_matrix(space.dim, n, seed);
  RandomStream random(seed, Purpose::kAct);
  if (space.discrete)
    for (Index j = 0; j < n; ++j) actions(0, j) = random.below(static_cast<std::uint32_t>(space.n));
  return actions;
}

inline bool same_store(const TensorStore& a, const TensorStore& b) {
  if (a.tensors.size() != b.tensors.size() || a.metadata != b.metadata) return false;
  for (auto i = a.tensors.begin(), j = b.tensors.begin(); i != a.tensors.end(); ++i, ++j)
    if (i->first != j->first || i->second.bytes != j->second.bytes) return false;
  return true;
}

template <class T>
TensorStore archived(T& object) {
  TensorStore store;
  Archive archive(store, Archive::Mode::kSave);
  object.archive(archive);
  return store;
}

}  // namespace agail
