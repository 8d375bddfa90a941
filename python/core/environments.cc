// Built-in environments, for Gymnasium: one, and many side by side.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>

#include "agail/base/error.h"
#include "agail/base/thread_pool.h"
#include "agail/env/environment.h"
#include "arrays.h"
#include "bind.h"

namespace agail {

namespace nb = nanobind;

namespace {

nb::dict describe(const std::string& id) {
  const EnvironmentSpec spec = environment_spec(id);
  nb::dict result;
  result["id"] = spec.id;
  result["observation_dim"] = spec.observation_dim;
  result["float32"] = spec.observation_is_float32;
  result["max_episode_steps"] = spec.max_episode_steps;
  if (spec.action.discrete) {
    result["n"] = spec.action.n;
  } else {
    result["low"] = spec.action.low;
    result["high"] = spec.action.high;
  }
  return result;
}

// Environments of one kind, each with episodes of its own. Arrays have one row an environment.
class NativeEnvironments {
 public:
  NativeEnvironments(const std::string& id, int count, int threads)
      : pool_(threads_of(count, threads)) {
    for (int i = 0; i < count; ++i) lanes_.push_back({make_environment(id)});
    const EnvironmentSpec& spec = lanes_.front().environment->spec();
    dim_ = static_cast<std::size_t>(spec.observation_dim);
    action_dim_ = static_cast<std::size_t>(spec.action.dim);
    discrete_actions_ = spec.action.n;
  }

  // Starts the next episode of each environment that `mask` marks; with seeds, its first one under
  // that seed.
  Array<double> reset(const std::vector<std::uint64_t>& seeds, const std::vector<bool>& mask) {
    check_count("seeds", seeds.empty() ? lanes_.size() : seeds.size());
    check_count("entries of reset_mask", mask.size());
    Array<double> observations = make_array<double>({lanes_.size(), dim_});
    double* out = observations.data();
    const nb::gil_scoped_release no_gil;
    for_each_lane([&](std::size_t i, Lane& lane) {
      if (mask[i]) {
        if (!seeds.empty()) {
          lane.seed = seeds[i];
          lane.episode = 0;
        }
        start(lane);
      }
      std::ranges::copy(lane.environment->observation(), out + i * dim_);
    });
    return observations;
  }

  // One step each. With autoreset (Gymnasium's NEXT_STEP) an environment whose episode has ended
  // starts the next one instead, with reward 0.
  nb::tuple step(const InputArray<float>& actions, bool autoreset) {
    const std::size_t n = lanes_.size();
    check(actions);
    Array<double> observations = make_array<double>({n, dim_}), rewards = make_array<double>({n});
    Array<bool> terminated = make_array<bool>({n}), truncated = make_array<bool>({n});
    const float* in = actions.data();
    double* out = observations.data();
    {
      const nb::gil_scoped_release no_gil;
      for_each_lane([&](std::size_t i, Lane& lane) {
        StepResult result;
        if (autoreset && lane.ended) {
          start(lane);
        } else {
          result = lane.environment->step({in + i * action_dim_, action_dim_});
          lane.ended = result.terminated || result.truncated;
        }
        rewards.data()[i] = result.reward;
        terminated.data()[i] = result.terminated;
        truncated.data()[i] = result.truncated;
        std::ranges::copy(lane.environment->observation(), out + i * dim_);
      });
    }
    return nb::make_tuple(observations, rewards, terminated, truncated);
  }

  std::vector<double> save(std::size_t lane) { return lanes_.at(lane).environment->save(); }
  void restore(std::size_t lane, const std::vector<double>& state) {
    lanes_.at(lane).environment->restore(state);
  }

 private:
  struct Lane {
    std::unique_ptr<Environment> environment;
    std::uint64_t seed = 0;
    std::uint32_t episode = 0;
    bool ended = false;
  };

  // InputError if there can be no such environments.
  static int threads_of(int count, int threads) {
    if (count < 1) throw InputError("num_envs is " + std::to_string(count) + "; at least 1");
    if (threads < 1 || threads > 4096)
      throw InputError("threads = " + std::to_string(threads) + " should be from 1 to 4096");
    return threads;
  }

  static void start(Lane& lane) {
    RandomStream random(lane.seed, Purpose::kReset, 0, lane.episode++);
    lane.environment->reset(random);
    lane.ended = false;
  }

  void check_count(const std::string& what, std::size_t count) const {
    if (count != lanes_.size())
      throw InputError("reset() got " + std::to_string(count) + " " + what + " for " +
                       std::to_string(lanes_.size()) + " environments; one each");
  }

  void check(const InputArray<float>& actions) const {
    if (actions.size() != lanes_.size() * action_dim_)
      throw InputError("step() takes " + std::to_string(lanes_.size() * action_dim_) +
                       " numbers of actions, not " + std::to_string(actions.size()));
    if (discrete_actions_ == 0) return;
    for (std::size_t i = 0; i < actions.size(); ++i) {
      const float action = actions.data()[i];
      if (!(action >= 0 && action < static_cast<float>(discrete_actions_) &&
            action == std::floor(action)))
        throw InputError("there is no action " + std::to_string(action) + "; they are 0 to " +
                         std::to_string(discrete_actions_ - 1));
    }
  }

  template <class F>
  void for_each_lane(F&& f) {
    pool_.run(static_cast<int>(lanes_.size()), [&](int task, int) {
      const auto i = static_cast<std::size_t>(task);
      f(i, lanes_[i]);
    });
  }

  ThreadPool pool_;
  std::vector<Lane> lanes_;
  std::size_t dim_ = 0, action_dim_ = 0;
  int discrete_actions_ = 0;  // 0: continuous
};

}  // namespace

void bind_environments(nb::module_& module) {
  module.def("environment_ids", &environment_ids, "Built-in ids, as agail envs lists them.");
  module.def("default_threads", &default_threads, "The cores of this machine or container.");
  module.def("environment_spec", &describe, nb::arg("id"),
             "Sizes and bounds of a built-in environment.");
  nb::class_<NativeEnvironments>(module, "NativeEnvironments",
                                 "Built-in environments of one kind, side by side.")
      .def(nb::init<const std::string&, int, int>(), nb::arg("id"), nb::arg("count"),
           nb::arg("threads"))
      .def("reset", &NativeEnvironments::reset, nb::arg("seeds"), nb::arg("mask"))
      .def("step", &NativeEnvironments::step, nb::arg("actions"), nb::arg("autoreset"))
      .def("save", &NativeEnvironments::save, nb::arg("lane"))
      .def("restore", &NativeEnvironments::restore, nb::arg("lane"), nb::arg("state"));
}

}  // namespace agail
