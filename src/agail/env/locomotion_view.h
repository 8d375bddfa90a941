// What a task reads off the simulation. All formulas of observations, rewards and endings are here;
// the order of their operations is Gymnasium's, because another order would round otherwise.
#pragma once

#include <mujoco/mujoco.h>

#include <span>

#include "agail/env/locomotion_task.h"

namespace agail {

struct LocomotionView {
  const LocomotionTask& task;
  const mjModel& model;
  const mjData& data;
};

int observation_dim(const LocomotionTask& task, const mjModel& model);

// Fills `observation` (observation_dim values).
void observe(const LocomotionView& view, std::span<double> observation);

// The x by which progress is measured (m).
double progress(const LocomotionView& view);

// `speed`: change of progress() in this step, in m/s. `action`: the float32 action that data.ctrl
// was set to.
double reward(const LocomotionView& view, std::span<const float> action, double speed,
              bool healthy);

// Whether the episode goes on.
bool healthy(const LocomotionView& view);

// Whether observation or reward want mj_rnePostConstraint after the physics steps.
bool needs_contact_forces(const LocomotionTask& task);

}  // namespace agail
