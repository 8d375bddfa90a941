// Inverse dynamics: which action led from s to s', learned where the action is available, asked
// where it is missing (Torabi et al., "Behavioral Cloning from Observation", IJCAI 2018,
// section 4.1).
#pragma once

#include "agail/imitation/action_regression.h"
#include "agail/imitation/demo_data.h"
#include "agail/nn/normalizer.h"

namespace agail {

// Learns from demos.some_action and fills missing entries of `actions` in place (within the
// action's bounds); `available` becomes 1 where an entry is known or was filled. Known entries stay
// as they are. A dimension that no demonstration tells stays missing: there is nothing to infer it
// from.
RegressionReport infer_missing_actions(const DemoData& demos, const ActionSpace& action,
                                       const InverseDynamicsSettings& settings, double clip,
                                       ThreadPool& pool, std::uint64_t seed, Matrix<float>& actions,
                                       Matrix<float>& available);

}  // namespace agail
