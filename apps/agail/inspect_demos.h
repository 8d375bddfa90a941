// What `agail inspect` says of demonstrations.
#pragma once

#include <ostream>

#include "agail/demos/demonstrations.h"

namespace agail {

// In words, or as one JSON object with the keys environment, episodes, transitions, missing_ratio,
// mean_return (null without rewards), observation_dim, action_dim, actions (number of discrete
// ones, else null), pattern (null if unknown), complete_steps (share of steps with the whole
// action), lengths {min, mean, max}.
void describe_demonstrations(const Demonstrations& demonstrations, bool json, std::ostream& out);

}  // namespace agail
