#include "agail/env/locomotion.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "agail/base/error.h"
#include "agail/env/locomotion_view.h"
#include "agail/env/model.h"

namespace agail {
namespace {

using Data = std::unique_ptr<mjData, decltype(&mj_deleteData)>;

EnvironmentSpec make_spec(const LocomotionTask& task, const mjModel& model) {
  EnvironmentSpec spec;
  spec.id = task.id;
  spec.observation_dim = observation_dim(task, model);
  spec.action.dim = static_cast<int>(model.nu);
  for (std::ptrdiff_t i = 0; i < model.nu; ++i) {
    spec.action.low.push_back(static_cast<float>(model.actuator_ctrlrange[2 * i]));
    spec.action.high.push_back(static_cast<float>(model.actuator_ctrlrange[2 * i + 1]));
  }
  spec.max_episode_steps = task.max_episode_steps;
  return spec;
}

Data make_data(const mjModel& model) {
  const QuietMuJoCo quiet;
  Data data(mj_makeData(&model), mj_deleteData);
  if (!data) throw SystemError("no memory for the simulation");
  return data;
}

class Locomotion final : public Environment {
 public:
  Locomotion(const LocomotionTask& task, std::shared_ptr<const mjModel> model)
      : Environment(make_spec(task, *model)),
        task_(task),
        model_(std::move(model)),
        data_(make_data(*model_)) {
    observation_.resize(static_cast<std::size_t>(spec().observation_dim));
    candidate_ = observation_;
    const QuietMuJoCo quiet;
    mj_forward(model_.get(), data_.get());
    observe(view(), observation_);
    progress_ = progress(view());
  }

  std::span<const double> observation() const override { return observation_; }

 protected:
  void do_reset(RandomStream& random) override;
  StepResult do_step(std::span<const float> action) override;
  std::vector<double> do_save() const override;
  void do_restore(std::span<const double> state) override;

 private:
  bool simulate();  // false if the physics broke down
  LocomotionView view() const { return {task_, *model_, *data_}; }

  LocomotionTask task_;
  std::shared_ptr<const mjModel> model_;
  Data data_;
  std::vector<double> observation_;
  std::vector<double> candidate_;  // the next observation, until it is known to be finite
  double progress_ = 0;
};

void Locomotion::do_reset(RandomStream& random) {
  const QuietMuJoCo quiet;
  mjData& d = *data_;
  mj_resetData(model_.get(), &d);  // clears the warnings, too
  const double noise = task_.reset_noise;
  for (int i = 0; i < model_->nq; ++i) d.qpos[i] = model_->qpos0[i] + random.uniform(-noise, noise);
  for (int i = 0; i < model_->nv; ++i)
    d.qvel[i] = task_.normal_velocities ? noise * random.normal() : random.uniform(-noise, noise);
  mj_forward(model_.get(), &d);
  observe(view(), observation_);
  progress_ = progress(view());
}

StepResult Locomotion::do_step(std::span<const float> action) {
  const QuietMuJoCo quiet;
  std::ranges::copy(action, data_->ctrl);
  StepResult result;
  if (simulate()) {
    const double before = progress_;
    progress_ = progress(view());
    const double seconds = model_->opt.timestep * task_.frame_skip;
    const bool is_healthy = healthy(view());
    observe(view(), candidate_);
    result.reward = reward(view(), action, (progress_ - before) / seconds, is_healthy);
    result.terminated = !is_healthy;
    if (std::isfinite(result.reward) &&
        std::ranges::all_of(candidate_, [](double v) { return std::isfinite(v); })) {
      observation_.swap(candidate_);
      return result;
    }
  }
  result.reward = 0;
  result.terminated = result.diverged = true;
  return result;
}

bool Locomotion::simulate() {
  // With the automatic reset off MuJoCo goes on with a bad state, but it counts a warning. Warnings
  // stay counted until a reset or a restore, and so a broken simulation stays broken.
  const auto broken = [&] {
    return data_->warning[mjWARN_BADQPOS].number + data_->warning[mjWARN_BADQVEL].number +
               data_->warning[mjWARN_BADQACC].number >
           0;
  };
  for (int i = 0; i < task_.frame_skip && !broken(); ++i) mj_step(model_.get(), data_.get());
  if (broken()) return false;
  if (needs_contact_forces(task_)) mj_rnePostConstraint(model_.get(), data_.get());
  return true;
}

std::vector<double> Locomotion::do_save() const {
  std::vector<double> state(
      1 + static_cast<std::size_t>(mj_stateSize(model_.get(), mjSTATE_INTEGRATION)));
  state[0] = progress_;
  mj_getState(model_.get(), data_.get(), state.data() + 1, mjSTATE_INTEGRATION);
  state.insert(state.end(), observation_.begin(), observation_.end());
  return state;
}

void Locomotion::do_restore(std::span<const double> state) {
  const QuietMuJoCo quiet;
  progress_ = state[0];
  mj_setState(model_.get(), data_.get(), state.data() + 1, mjSTATE_INTEGRATION);
  std::ranges::copy(state.last(observation_.size()), observation_.begin());
  for (mjWarningStat& warning : data_->warning) warning.number = 0;
}

}  // namespace

std::unique_ptr<Environment> make_locomotion(const LocomotionTask& task) {
  return std::make_unique<Locomotion>(task, load_model(task.model));
}

EnvironmentSpec locomotion_spec(const LocomotionTask& task) {
  return make_spec(task, *load_model(task.model));
}

}  // namespace agail
