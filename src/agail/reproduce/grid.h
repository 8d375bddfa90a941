// The folder of the experiment, and the jobs that fill it.
//
//   experiment.json             what is run
//   records/<run>.json          what each finished run leaves; records/demonstrations/<env>.json:
//   the
//                               expert and its demonstrations
//   table.md, table.csv         computed from records/
//   runs/<run>/                 run folders
//   demonstrations/<env>/       missing-0.hdf5 ... missing-100.hdf5
//   experts/                    candidates: runs/, records/, logs/, locks/; may be shared
//   logs/, locks/
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "agail/reproduce/experiment.h"
#include "agail/reproduce/job.h"

namespace agail {

// Part `index` of `count`, from 0: these runs of the grid. Experts and demonstrations are made by
// whichever part comes first.
struct Shard {
  int index = 0, count = 1;
};

struct Grid {
  std::vector<Job> jobs;                   // experts, demonstrations, runs; the longest first
  std::vector<std::optional<Cell>> cells;  // of each job; none: no run of the grid
};

// Creates the folders and experiment.json. InputError if they are of another experiment.
Grid prepare_grid(const Experiment& experiment, const GridFilter& filter, Shard shard,
                  const std::filesystem::path& out, const std::filesystem::path& experts);

}  // namespace agail
