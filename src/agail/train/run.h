// A training run and its folder: config.toml, progress.csv, episodes.csv, event files,
// checkpoints/, policies, summary.json.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>

#include "agail/train/checkpoint.h"
#include "agail/train/evaluation.h"
#include "agail/train/trainer.h"

namespace agail {

struct RunOutcome {
  int signal = 0;        // that interrupted it, after a checkpoint was saved; 0: none
  bool stopped = false;  // by on_update, after a checkpoint was saved
  std::int64_t timesteps = 0;
  double start_seconds = 0;          // until there was a policy: cloning, where it starts cloned
  std::optional<Evaluation> cloned;  // of the start, where the policy starts cloned
  RunEvaluations evaluations;
};

struct RunOptions {
  bool resume = false;
  bool shows_progress = true;  // a bar or lines on stderr
  // Called on the first rank, in the thread that trains, after each update with the row that
  // progress.csv got (columns: progress_columns()). False stops the run as a signal would.
  std::function<bool(std::span<const double> row)> on_update{};
};

// Trains in `folder`, which nobody else may train in meanwhile (InputError). Without `resume` the
// folder must not hold a run; with it, the run goes on from its checkpoint (from the start, if it
// was cut off before the first), to the same policy as if it had never stopped. Several ranks call
// it together, with equal tasks; rank 0 alone reads and writes the folder, and all have the same
// outcome. A failure once training has begun ends all ranks (or_abort).
RunOutcome run_training(TrainingTask task, const std::filesystem::path& folder, RunOptions options,
                        Communicator& communicator = no_other_ranks());

}  // namespace agail
