// Step tables from numpy's .npz.
#pragma once

#include <string>
#include <vector>

#include "agail/demos/step_table.h"

namespace agail {

// Arrays, N being the number of rows of `observations` and E the number of episodes:
//   observations        N x D                                                required
//   actions             N x A, or N (one dimension; discrete if integers); NaN: missing
//   action_available    N, N x 1 or N x A of 0 and 1: missing where 0
//   next_observations   N x D
//   rewards, terminations (terminals), truncations (timeouts)   N
//   episodes (an id a row), episode_starts (first rows) or episode_ends (last rows + 1): one of
//   them, or none if
//                       episodes end where terminations or truncations say so
// All but `observations` are optional. Without next_observations the arrays of actions, rewards and
// flags may leave out the final states' rows: N - E rows, episode after episode. Arrays of other
// names are put into `ignored`.
StepTable read_npz(const std::string& path, std::vector<std::string>& ignored);

}  // namespace agail
