// Demonstrations in memory: trajectories of states, with actions of which some are missing.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "agail/base/spaces.h"

namespace agail {

template <class T>
using RowMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The first row with a number that float32, in which policies compute, cannot hold; none: -1. NaN
// passes.
Eigen::Index first_row_beyond_float32(const RowMatrix<double>& values);

// One trajectory of T steps.
struct DemoEpisode {
  RowMatrix<double> observations;  // (T+1) x observation_dim, finite
  RowMatrix<double>
      actions;  // T x action.dim; discrete: the index. Missing entries: NaN, discrete 0
  RowMatrix<std::uint8_t> available;  // T x action.dim; 1: the entry is known
  std::vector<double>
      rewards;  // T, or empty if the file has none; only ever shown, never learned from
  std::vector<std::uint8_t> terminations;  // T
  std::vector<std::uint8_t> truncations;   // T
  std::optional<std::int64_t> seed;        // of the environment's reset, if the file tells it

  Eigen::Index steps() const { return actions.rows(); }
};

struct Demonstrations {
  std::string environment;  // Gymnasium id, empty if the file does not say
  ActionSpace action;
  int observation_dim = 0;
  bool observations_are_float32 = false;  // dtypes of the file, kept when it is written again
  bool actions_are_float32 = true;
  std::vector<DemoEpisode> episodes;
  std::string pattern;  // how actions were removed, empty if unknown or nothing was
  // Whatever else the file says of itself (author, algorithm_name, env_spec...): Minari's metadata
  // as a JSON object, carried over when it is written again. Empty if there is none.
  std::string metadata;

  Eigen::Index transitions() const;
  // eta = missing action entries / all entries, in [0, 1]. 1 if the file has no actions at all
  // (action.dim 0).
  double missing_ratio() const;
  // Every episode has rewards. False without episodes.
  bool has_rewards() const;
  // Mean undiscounted return of the episodes. Needs has_rewards().
  double mean_return() const;
};

}  // namespace agail
