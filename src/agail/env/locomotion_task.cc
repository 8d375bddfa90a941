#include "agail/env/locomotion_task.h"

namespace agail {
namespace {

// Figures of Gymnasium 1.4.0. Version 4 and version 5 differ in little: what a function is given,
// or what follows it.

LocomotionTask hopper(const std::string& id, bool reward_when_unhealthy) {
  LocomotionTask task;
  task.id = id;
  task.model = "hopper";
  task.frame_skip = 4;
  task.first_position = 1;
  task.velocity_clip = 10;
  task.control_weight = 1e-3;
  task.healthy_reward = 1;
  task.reward_when_unhealthy = reward_when_unhealthy;
  task.healthy = {{1, 0.7, LocomotionTask::kInfinity}, {2, -0.2, 0.2}};
  task.state_limit = 100;
  task.reset_noise = 5e-3;
  return task;
}

LocomotionTask walker2d(const std::string& id, const std::string& model,
                        bool reward_when_unhealthy) {
  LocomotionTask task = hopper(id, reward_when_unhealthy);
  task.model = model;
  task.healthy = {{1, 0.8, 2.0}, {2, -1.0, 1.0}};
  task.state_limit = LocomotionTask::kInfinity;
  return task;
}

LocomotionTask half_cheetah(const std::string& id) {
  LocomotionTask task;
  task.id = id;
  task.model = "half_cheetah";
  task.frame_skip = 5;
  task.first_position = 1;
  task.control_weight = 0.1;
  task.reset_noise = 0.1;
  task.normal_velocities = true;
  return task;
}

LocomotionTask swimmer(const std::string& id) {
  LocomotionTask task;
  task.id = id;
  task.model = "swimmer";
  task.frame_skip = 4;
  task.first_position = 2;
  task.control_weight = 1e-4;
  task.reset_noise = 0.1;
  return task;
}

LocomotionTask ant_v4() {
  LocomotionTask task;
  task.id = "Ant-v4";
  task.model = "ant";
  task.frame_skip = 5;
  task.first_position = 2;
  task.progress = LocomotionTask::Progress::kTorso;
  task.control_weight = 0.5;
  task.healthy_reward = 1;
  task.reward_when_unhealthy = true;
  task.healthy = {{2, 0.2, 1.0, true}};
  task.reset_noise = 0.1;
  task.normal_velocities = true;
  return task;
}

LocomotionTask ant_v5() {
  LocomotionTask task = ant_v4();
  task.id = "Ant-v5";
  task.observe_contacts = true;
  task.first_body = 1;
  task.contact_clip = 1;
  task.contact_weight = 5e-4;
  task.reward_when_unhealthy = false;
  return task;
}

LocomotionTask humanoid_v4() {
  LocomotionTask task;
  task.id = "Humanoid-v4";
  task.model = "humanoid";
  task.frame_skip = 5;
  task.first_position = 2;
  task.observe_bodies = true;
  task.observe_contacts = true;
  task.progress = LocomotionTask::Progress::kMassCentre;
  task.forward_weight = 1.25;
  task.control_weight = 0.1;
  task.control_cost_in_float32 = false;
  task.healthy_reward = 5;
  task.reward_when_unhealthy = true;
  task.healthy = {{2, 1.0, 2.0}};
  task.reset_noise = 0.01;
  return task;
}

LocomotionTask humanoid_v5() {
  LocomotionTask task = humanoid_v4();
  task.id = "Humanoid-v5";
  task.first_body = 1;
  task.first_actuator_dof = 6;  // nothing drives the root
  task.contact_weight = 5e-7;
  task.contact_cost_max = 10;
  task.reward_when_unhealthy = false;
  return task;
}

}  // namespace

const std::vector<LocomotionTask>& locomotion_tasks() {
  static const std::vector<LocomotionTask> tasks = {
      hopper("Hopper-v4", true),
      hopper("Hopper-v5", false),
      walker2d("Walker2d-v4", "walker2d_v4", true),
      walker2d("Walker2d-v5", "walker2d_v5", false),
      humanoid_v4(),
      humanoid_v5(),
      half_cheetah("HalfCheetah-v4"),
      half_cheetah("HalfCheetah-v5"),
      ant_v4(),
      ant_v5(),
      swimmer("Swimmer-v4"),
      swimmer("Swimmer-v5"),
  };
  return tasks;
}

}  // namespace agail
