// MuJoCo locomotion, driven by a LocomotionTask.
#pragma once

#include <memory>

#include "agail/env/environment.h"
#include "agail/env/locomotion_task.h"

namespace agail {

// A saved state is: elapsed steps, the x by which progress is measured, MuJoCo's
// mjSTATE_INTEGRATION, the observation. The x and the observation are in it because they come from
// inside the last physics step (its last Runge-Kutta stage, before the state's final update) and no
// forward pass from the integration state gives them back.
std::unique_ptr<Environment> make_locomotion(const LocomotionTask& task);

EnvironmentSpec locomotion_spec(const LocomotionTask& task);

}  // namespace agail
