// Demonstrations as learners take them: one transition a column, in the order of the file.
#pragma once

#include <cstdint>
#include <vector>

#include "agail/base/spaces.h"
#include "agail/demos/demonstrations.h"
#include "agail/nn/matrix.h"

namespace agail {

struct DemoData {
  // The demonstrations' action space is that of the environment, with its bounds.
  explicit DemoData(const Demonstrations& demos);

  Index size() const { return states.cols(); }
  Index action_dim() const { return actions.rows(); }

  // s_{t+1}: observation_dim numbers.
  const float* next_state(Index column) const {
    const Index end = ends[static_cast<std::size_t>(column)];
    return end < 0 ? states.col(column + 1).data() : final_states.col(end).data();
  }

  Matrix<float> next_states() const;  // observation_dim x n, a copy

  // Bytes that demonstrations of this size will take here.
  static std::uint64_t memory(const Demonstrations& demos);

  Matrix<float> states;     // observation_dim x n, s_t
  Matrix<float> actions;    // action_dim x n (discrete: the index), within the space's bounds, in
                            // ActionUnits; 0 where missing, whatever the file holds there
  Matrix<float> available;  // action_dim x n, 1 where known
  Matrix<float> final_states;      // observation_dim x episodes: the states after the last actions
  std::vector<std::int32_t> ends;  // n: the episode whose last step this is, or -1
  std::vector<Index> some_action;  // columns with any known entry
  std::vector<Index> full_action;  // columns with all entries known
};

// Encodes actions for a network: one-hot if discrete, else as they are. `encoded`:
// space.encoded_dim() numbers.
void encode_action(const ActionSpace& space, const float* action, float* encoded);

}  // namespace agail
