// What a MuJoCo locomotion task is: data. A new task is a new entry of the table, not a new class.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace agail {

struct LocomotionTask {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  std::string id;
  std::string model;   // models/<model>.xml
  int frame_skip = 1;  // physics steps in one environment step
  int max_episode_steps = 1000;

  // Observation, in this order; each part is skipped unless asked for.
  int first_position = 0;            // qpos from this index on: progress itself is not observed
  double velocity_clip = kInfinity;  // qvel, each entry clipped to +- this
  bool observe_bodies = false;       // cinert and cvel of the bodies, then qfrc_actuator
  int first_actuator_dof = 0;        // qfrc_actuator from this index on
  bool observe_contacts = false;     // cfrc_ext of the bodies
  int first_body = 0;                // of those parts; 0 is the world
  double contact_clip = kInfinity;   // each entry of cfrc_ext clipped to +- this, in the costs, too

  // Reward = forward_weight * speed along x + healthy_reward - control_weight * sum of squared
  // controls
  //          - min(contact_cost_max, contact_weight * sum of squared contact forces).
  enum class Progress {
    kRootCoordinate,
    kMassCentre,
    kTorso
  };  // whose x: qpos[0], centre of mass, body 1
  Progress progress = Progress::kRootCoordinate;
  double forward_weight = 1;
  double control_weight = 0;
  bool control_cost_in_float32 =
      true;  // of the float32 action, else of the controls in double precision
  double contact_weight = 0;
  double contact_cost_max = kInfinity;
  double healthy_reward = 0;
  bool reward_when_unhealthy =
      false;  // v4 pays healthy_reward in the step that ends the episode, v5 does not

  // The episode goes on while all of these hold.
  struct Range {
    int position;  // index in qpos
    double low, high;
    bool inclusive = false;
  };
  std::vector<Range> healthy;
  double state_limit =
      kInfinity;  // absolute value of qpos from index 2 on and of qvel stays below this

  // Reset: qpos and qvel get uniform noise of +- this; qvel normal noise of this scale if
  // normal_velocities.
  double reset_noise = 0;
  bool normal_velocities = false;
};

// The built-in tasks, in the order of `agail envs`.
const std::vector<LocomotionTask>& locomotion_tasks();

}  // namespace agail
