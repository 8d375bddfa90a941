#include "agail/env/locomotion_view.h"

#include <algorithm>
#include <cmath>

#include "agail/env/numpy_sum.h"

namespace agail {
namespace {

double contact_force(const LocomotionView& view, std::size_t i) {
  return std::clamp(view.data.cfrc_ext[i], -view.task.contact_clip, view.task.contact_clip);
}

double control_cost(const LocomotionView& view, std::span<const float> action) {
  if (view.task.control_cost_in_float32) {
    const auto square = [&](std::size_t i) { return action[i] * action[i]; };
    return static_cast<float>(view.task.control_weight) *
           numpy_sum<float>(0, action.size(), square);
  }
  const auto square = [&](std::size_t i) { return view.data.ctrl[i] * view.data.ctrl[i]; };
  return view.task.control_weight * numpy_sum<double>(0, action.size(), square);
}

double contact_cost(const LocomotionView& view) {
  if (view.task.contact_weight == 0) return 0;
  const auto square = [&](std::size_t i) {
    return contact_force(view, i) * contact_force(view, i);
  };
  const std::size_t n = 6 * static_cast<std::size_t>(view.model.nbody);
  return std::min(view.task.contact_cost_max,
                  view.task.contact_weight * numpy_sum<double>(0, n, square));
}

bool holds(const LocomotionTask::Range& range, double value) {
  return range.inclusive ? range.low <= value && value <= range.high
                         : range.low < value && value < range.high;
}

}  // namespace

int observation_dim(const LocomotionTask& task, const mjModel& model) {
  const mjtSize bodies = model.nbody - task.first_body;
  mjtSize dim = model.nq - task.first_position + model.nv;
  if (task.observe_bodies) dim += 16 * bodies + model.nv - task.first_actuator_dof;
  if (task.observe_contacts) dim += 6 * bodies;
  return static_cast<int>(dim);
}

void observe(const LocomotionView& view, std::span<double> observation) {
  const LocomotionTask& task = view.task;
  const mjModel& m = view.model;
  const mjData& d = view.data;
  double* out = observation.data();
  out = std::copy(d.qpos + task.first_position, d.qpos + m.nq, out);
  out = std::transform(d.qvel, d.qvel + m.nv, out, [&task](double v) {
    return std::clamp(v, -task.velocity_clip, task.velocity_clip);
  });
  if (task.observe_bodies) {
    const std::ptrdiff_t first = task.first_body;
    const std::ptrdiff_t bodies = m.nbody;
    out = std::copy(d.cinert + 10 * first, d.cinert + 10 * bodies, out);
    out = std::copy(d.cvel + 6 * first, d.cvel + 6 * bodies, out);
    out = std::copy(d.qfrc_actuator + task.first_actuator_dof, d.qfrc_actuator + m.nv, out);
  }
  if (task.observe_contacts)
    for (int i = 6 * task.first_body; i < 6 * m.nbody; ++i)
      *out++ = contact_force(view, static_cast<std::size_t>(i));
}

double progress(const LocomotionView& view) {
  switch (view.task.progress) {
    case LocomotionTask::Progress::kRootCoordinate:
      return view.data.qpos[0];
    case LocomotionTask::Progress::kTorso:
      return view.data.xpos[3];
    case LocomotionTask::Progress::kMassCentre:
      break;
  }
  const mjtNum* mass = view.model.body_mass;
  const auto bodies = static_cast<std::size_t>(view.model.nbody);
  double moment = 0;  // np.einsum adds in order, np.sum does not
  for (std::size_t i = 0; i < bodies; ++i) moment += mass[i] * view.data.xipos[3 * i];
  return moment / numpy_sum<double>(0, bodies, [mass](std::size_t i) { return mass[i]; });
}

double reward(const LocomotionView& view, std::span<const float> action, double speed,
              bool is_healthy) {
  const LocomotionTask& task = view.task;
  const double alive = is_healthy || task.reward_when_unhealthy ? task.healthy_reward : 0.0;
  const double gains = task.forward_weight * speed + alive;
  return gains - (control_cost(view, action) + contact_cost(view));
}

bool healthy(const LocomotionView& view) {
  const LocomotionTask& task = view.task;
  const mjModel& m = view.model;
  const mjData& d = view.data;
  for (const LocomotionTask::Range& range : task.healthy)
    if (!holds(range, d.qpos[range.position])) return false;
  if (task.state_limit == LocomotionTask::kInfinity) return true;
  const auto inside = [&task](double v) { return std::abs(v) < task.state_limit; };
  return std::all_of(d.qpos + 2, d.qpos + m.nq, inside) &&
         std::all_of(d.qvel, d.qvel + m.nv, inside);
}

bool needs_contact_forces(const LocomotionTask& task) {
  return task.observe_contacts || task.contact_weight > 0;
}

}  // namespace agail
