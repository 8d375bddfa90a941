#include "agail/env/environment.h"

#include "agail/base/error.h"

namespace agail {

void Environment::reset(RandomStream& random) {
  elapsed_ = 0;
  do_reset(random);
}

StepResult Environment::step(std::span<const float> action) {
  AGAIL_CHECK(action.size() == static_cast<std::size_t>(spec_.action.dim));
  StepResult result = do_step(action);
  ++elapsed_;
  // As Gymnasium's TimeLimit: an episode that ends by itself in its last step is terminated and
  // truncated.
  if (spec_.max_episode_steps > 0 && elapsed_ >= spec_.max_episode_steps) result.truncated = true;
  return result;
}

std::vector<double> Environment::save() const {
  if (!can_save()) return {};
  std::vector<double> state = do_save();
  state.insert(state.begin(), static_cast<double>(elapsed_));
  return state;
}

void Environment::restore(std::span<const double> state) {
  const std::size_t expected = do_save().size() + 1;
  if (state.size() != expected)
    throw InputError("a state of " + spec_.id + " has " + std::to_string(expected) +
                     " values, not " + std::to_string(state.size()));
  if (!(state[0] >= 0 && state[0] <= 1e9))
    throw InputError("a state of " + spec_.id + " begins with its elapsed steps");
  do_restore(state.subspan(1));
  elapsed_ = static_cast<int>(state[0]);
}

std::string sizes_in_words(int observations, const ActionSpace& action) {
  return std::to_string(observations) + " observations and " +
         (action.discrete ? std::to_string(action.n) + " discrete actions"
                          : std::to_string(action.dim) + " continuous action dimensions");
}

}  // namespace agail
