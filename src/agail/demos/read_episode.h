// One episode_<i> group of a Minari file, read as it stands; what it means is decided with the
// whole file known.
#pragma once

#include <optional>

#include "agail/demos/demonstrations.h"
#include "agail/demos/hdf5.h"

namespace agail {

struct RawEpisode {
  std::string where;                         // for messages
  RowMatrix<double> observations;            // (T+1) x observation_dim, finite, also in float32
  std::optional<RowMatrix<double>> actions;  // T x action_dim, NaN or finite, known ones also in
                                             // float32; absent: the file has none
  std::optional<RowMatrix<std::uint8_t>>
      available;     // T x 1 or T x action_dim, 0 or 1; absent: no mask
  DemoEpisode rest;  // rewards, terminations, truncations, seed
  bool observations_are_float32 = false;
  bool actions_are_float32 = false;
  bool actions_are_integers = false;

  Eigen::Index steps() const { return observations.rows() - 1; }
};

// What reading an episode will take, in bytes.
struct EpisodeMemory {
  std::uint64_t kept = 0;          // as long as the demonstrations are there
  std::uint64_t passing = 0;       // on top, while it is read
  std::uint64_t observations = 0;  // not bytes: the entries of all observations
};

// From the shapes alone. Throws InputError where a dataset cannot be described.
EpisodeMemory memory_of_episode(const hdf5::Group& group);

// Throws InputError (what, where, how to mend it) for whatever does not fit Minari's layout.
RawEpisode read_episode(const hdf5::Group& group);

}  // namespace agail
