// Plain per-step tables, as people have them outside of Minari, and how they become demonstrations.
//
// A table has one row a state, in the order of time, the rows of an episode together. Row t of an
// episode holds observation t and, if known, the action taken there, its reward and how the step
// ended.
//   - Without next_observations an episode of N rows has N-1 steps: its last row is the state after
//   the last action,
//     and that row's action and reward are not used.
//   - With next_observations each row is a step, N rows are N steps, and the last row's next
//   observation ends it.
// A termination or truncation may stand in the last step's row or in the row of the final state. An
// episode that says nothing of its end was cut off (truncated).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "agail/demos/demonstrations.h"

namespace agail {

struct StepTable {
  std::string where;                                   // the file, for messages
  RowMatrix<double> observations;                      // N x observation_dim
  std::optional<RowMatrix<double>> next_observations;  // N x observation_dim
  RowMatrix<double> actions;         // N x action_dim (0: none known); NaN: missing
  std::vector<double> rewards;       // N or none; NaN: not given
  std::vector<double> terminations;  // N or none; NaN: not given, as 0
  std::vector<double> truncations;   // N or none
  std::vector<std::size_t> starts;   // first row of each episode; none: see split_at_flags()
  bool discrete = false;             // what the file itself says of the actions
  bool observations_are_float32 = false;
};

// The starts of episodes that end at each row with a termination or truncation; one episode if
// there are no such rows.
std::vector<std::size_t> split_at_flags(const StepTable& table);

// The starts of runs of equal ids. Throws InputError if an id comes back after another one.
std::vector<std::size_t> split_at_changes(const std::vector<double>& ids, const std::string& where);

// `known`: the environment's action space, if it is one we know; else the space is unbounded, or
// {0, ..., largest}. Throws InputError (one line; what, which row, how to mend it) if the table
// does not make sense.
Demonstrations demonstrations_from(const StepTable& table, const std::string& environment,
                                   const std::optional<ActionSpace>& known);

}  // namespace agail
