#include "agail/imitation/demo_data.h"

#include <algorithm>

#include "agail/rl/action_units.h"

namespace agail {

DemoData::DemoData(const Demonstrations& demos) {
  const Index n = demos.transitions();
  const Index dim = demos.action.dim;
  const ActionUnits units(demos.action);
  states.resize(demos.observation_dim, n);
  final_states.resize(demos.observation_dim, static_cast<Index>(demos.episodes.size()));
  ends.assign(static_cast<std::size_t>(n), -1);
  actions.setZero(dim, n);
  available.setZero(dim, n);
  Index column = 0, number = 0;
  for (const DemoEpisode& episode : demos.episodes) {
    for (Index t = 0; t < episode.steps(); ++t, ++column) {
      states.col(column) = episode.observations.row(t).transpose().cast<float>();
      Index known = 0;
      for (Index i = 0; i < dim; ++i) {
        if (episode.available(t, i) == 0) continue;  // what stands in a missing entry is never read
        actions(i, column) = units.from_environment(i, static_cast<float>(episode.actions(t, i)));
        available(i, column) = 1;
        ++known;
      }
      if (known > 0) some_action.push_back(column);
      if (known == dim && dim > 0) full_action.push_back(column);
    }
    if (episode.steps() > 0)
      ends[static_cast<std::size_t>(column - 1)] = static_cast<std::int32_t>(number);
    final_states.col(number++) = episode.observations.bottomRows(1).transpose().cast<float>();
  }
}

Matrix<float> DemoData::next_states() const {
  Matrix<float> all(states.rows(), size());
  for (Index j = 0; j < size(); ++j)
    all.col(j) = Eigen::Map<const Vector<float>>(next_state(j), states.rows());
  return all;
}

std::uint64_t DemoData::memory(const Demonstrations& demos) {
  const auto n = static_cast<std::uint64_t>(demos.transitions());
  const auto numbers = static_cast<std::uint64_t>(demos.observation_dim + 2 * demos.action.dim);
  return n * (sizeof(float) * numbers + sizeof(std::int32_t) + 2 * sizeof(Index)) +
         sizeof(float) * demos.episodes.size() * static_cast<std::uint64_t>(demos.observation_dim);
}

void encode_action(const ActionSpace& space, const float* action, float* encoded) {
  if (!space.discrete) {
    std::copy_n(action, space.dim, encoded);
    return;
  }
  std::fill_n(encoded, space.n, 0.0F);
  encoded[static_cast<Index>(action[0])] = 1;
}

}  // namespace agail
