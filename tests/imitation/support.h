// Demonstrations and batches to learn imitation from.
#pragma once

#include <limits>

#include "agail/demos/demonstrations.h"
#include "agail/demos/mask.h"
#include "agail/env/environment.h"
#include "agail/imitation/demo_data.h"
#include "agail/rl/rollout.h"
#include "rl/support.h"

namespace agail {

// One episode from columns of states (n + 1, the last is only a next state) and actions (n).
inline Demonstrations demonstrations_from(const Matrix<double>& states,
                                          const Matrix<double>& actions, const ActionSpace& space) {
  Demonstrations demos;
  demos.action = space;
  demos.observation_dim = static_cast<int>(states.rows());
  DemoEpisode episode;
  episode.observations = states.transpose();
  episode.actions = actions.transpose();
  episode.available.setOnes(actions.cols(), actions.rows());
  demos.episodes.push_back(std::move(episode));
  return demos;
}

// Episodes of an environment under random actions.
inline Demonstrations random_demonstrations(const std::string& id, int episodes,
                                            std::uint64_t seed) {
  const auto environment = make_environment(id);
  const EnvironmentSpec& spec = environment->spec();
  Demonstrations demos;
  demos.environment = id;
  demos.action = spec.action;
  demos.observation_dim = spec.observation_dim;
  for (int e = 0; e < episodes; ++e) {
    RandomStream random(seed, Purpose::kRecord, 0, static_cast<std::uint32_t>(e));
    environment->reset(random);
    std::vector<double> states(environment->observation().begin(),
                               environment->observation().end());
    std::vector<double> actions;
    for (bool done = false; !done;) {
      std::vector<float> action;
      for (int i = 0; i < spec.action.dim; ++i)
        action.push_back(spec.action.discrete ? static_cast<float>(random.below(
                                                    static_cast<std::uint32_t>(spec.action.n)))
                                              : static_cast<float>(random.uniform(-1, 1)));
      const StepResult result = environment->step(action);
      done = result.terminated || result.truncated;
      states.insert(states.end(), environment->observation().begin(),
                    environment->observation().end());
      actions.insert(actions.end(), action.begin(), action.end());
    }
    const auto steps = static_cast<Index>(actions.size()) / spec.action.dim;
    DemoEpisode episode;
    episode.observations =
        Eigen::Map<RowMatrix<double>>(states.data(), steps + 1, spec.observation_dim);
    episode.actions = Eigen::Map<RowMatrix<double>>(actions.data(), steps, spec.action.dim);
    episode.available.setOnes(steps, spec.action.dim);
    demos.episodes.push_back(std::move(episode));
  }
  return demos;
}

// What stands in the missing entries, which no learner may read.
inline void fill_missing(Demonstrations& demos, double value) {
  for (DemoEpisode& episode : demos.episodes)
    episode.actions = (episode.available.array() == 0)
                          .select(RowMatrix<double>::Constant(episode.actions.rows(),
                                                              episode.actions.cols(), value),
                                  episode.actions);
}

inline constexpr double kPoison[] = {0, 1e30, std::numeric_limits<double>::quiet_NaN()};

}  // namespace agail
