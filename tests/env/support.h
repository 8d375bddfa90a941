// Shared by the tests of the environments.
#pragma once

#include <string>
#include <vector>

#include "agail/env/environment.h"

namespace agail {

// Within the bounds, or a quarter of the time beyond them.
inline std::vector<float> random_action(const ActionSpace& space, RandomStream& random) {
  if (space.discrete)
    return {static_cast<float>(random.below(static_cast<std::uint32_t>(space.n)))};
  std::vector<float> action;
  for (std::size_t i = 0; i < space.low.size(); ++i) {
    const double scale = random.uniform() < 0.25 ? 3 : 1;
    action.push_back(static_cast<float>(random.uniform(
        scale * static_cast<double>(space.low[i]), scale * static_cast<double>(space.high[i]))));
  }
  return action;
}

// "Hopper-v5" as a part of a test's name.
inline std::string test_name(std::string id) {
  id.erase(id.find('-'), 1);
  return id;
}

}  // namespace agail
