// Inverse dynamics: which action led from s to s', learned where the action is available, asked
// where it is missing (Torabi et al., "Behavioral Cloning from Observation", IJCAI 2018,
// section 4.1).
#pragma once

#include "agail/imitation/action_regression.h"
#include "agail/imitation/demo_data.h"
#include "agail/nn/normalizer.h"

namespace agail {

// Learns from demos.some_action and fills every missing entry of `actions` in place (within the
// action's bounds). Known entries stay as they are.
RegressionReport infer_missing_actions(const DemoData& demos, const ActionSpace& action,
                                       const InverseDynamicsSettings& settings, double clip,
                                       ThreadPool& pool, std::uint64_t seed,
                                       Matrix<float>& actions);

}  // namespace agail
