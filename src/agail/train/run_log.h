// What a run tells while it goes on: progress.csv, episodes.csv, TensorBoard events, and a line or
// a bar on stderr.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "agail/train/csv_log.h"
#include "agail/train/evaluation.h"
#include "agail/train/tensorboard.h"
#include "agail/train/trainer.h"

namespace agail {

// Names as stable-baselines3 has them where it has the quantity.
std::vector<std::string> progress_columns();

// episodes.csv, a row a finished training episode: timesteps at the end of its update, its length
// and its return. Several lanes follow each other within an update.
std::vector<std::string> episode_columns();

class RunLog {
 public:
  // Files in `folder`, and progress on stderr if `shown`. After a resume `resume_step` is the
  // checkpoint's number of timesteps: what the files hold of later steps is dropped.
  RunLog(const std::filesystem::path& folder, std::int64_t total_timesteps,
         std::optional<std::int64_t> resume_step, bool shown = true);

  // `finished`: the training episodes that ended in this update's batch. Returns the row that
  // progress.csv got.
  std::vector<double> update(const UpdateReport& report, std::span<const FinishedEpisode> finished,
                             const Stopwatch& stopwatch,
                             const std::optional<Evaluation>& evaluation);
  // Before a checkpoint: its rows are on the disk; TensorBoard's events are with the operating
  // system.
  void flush() {
    events_.flush();
    csv_.sync();
    episodes_.sync();
  }
  // Ends the bar, if there is one.
  void finish();

 private:
  void show(const UpdateReport& report, double steps_per_second);

  using Clock = std::chrono::steady_clock;
  std::int64_t total_timesteps_, first_timesteps_;
  bool visible_;
  bool terminal_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point shown_;
  bool bar_open_ = false;
  std::optional<double> evaluated_return_;
  CsvLog csv_;
  CsvLog episodes_;
  TensorBoardWriter events_;
};

}  // namespace agail
