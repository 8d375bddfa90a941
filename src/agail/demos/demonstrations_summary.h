// What remains to be said of demonstrations once a learner has taken them.
#pragma once

#include <cstdint>
#include <optional>

#include "agail/demos/demonstrations.h"

namespace agail {

struct DemonstrationsSummary {
  std::size_t episodes = 0;
  Eigen::Index transitions = 0;
  double missing_ratio = 0;  // eta
  std::optional<double>
      mean_return;  // finite; absent if the file has no rewards, or their sum overflows
  std::uint32_t fingerprint = 0;  // of states, known actions, rewards and endings
};

DemonstrationsSummary summarise(const Demonstrations& demonstrations);

}  // namespace agail
