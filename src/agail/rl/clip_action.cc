// Apart from the collector, so that a policy can be used without environments.
#include <algorithm>

#include "agail/rl/action_units.h"

namespace agail {

void clip_action(const ActionSpace& space, const float* sampled, float* executed) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(space.dim); ++i)
    executed[i] = space.discrete ? sampled[i] : std::clamp(sampled[i], space.low[i], space.high[i]);
}

}  // namespace agail
