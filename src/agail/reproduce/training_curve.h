// Returns of training episodes against environment steps, and the statistic that the paper's Table
// 1 makes of them. Recomputed from the authors' training logs it is that of OpenAI Baselines'
// plot_util: a moving average over episodes, then a symmetric exponential moving average over
// steps.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace agail {

struct TrainingEpisode {
  double end = 0;  // environment steps so far: the lengths of this and all earlier episodes
  double episode_return = 0;
};

// From a run's episodes.csv. InputError if there is none.
std::vector<TrainingEpisode> read_training_episodes(const std::filesystem::path& run);

// Two-sided: entry i becomes the mean of entries i - radius ... i + radius, of those that exist.
std::vector<TrainingEpisode> moving_average(std::span<const TrainingEpisode> episodes, int radius);

// At `points` equally spaced positions from `low` to `high` (all of them if points > 1): the mean
// of the returns, weighted with exp(-distance / spacing); an episode at the very position counts
// twice, as both halves of the original contain it. NaN where all weights vanish.
std::vector<double> symmetric_moving_average(std::span<const TrainingEpisode> episodes, double low,
                                             double high, int points);

inline constexpr int kPaperRadius = 10;   // episodes
inline constexpr int kPaperPoints = 512;  // of the grid from the first to the last episode
inline constexpr int kCurveStride = 8;    // a record keeps every 8th point of a fixed grid

// What a record keeps of one run's training.
struct TrainingCurve {
  std::int64_t episodes = 0;           // that ended within the budget
  double first_end = 0, last_end = 0;  // of these
  // The smoothed episodes near the end: those whose weight in the last point can be above e^-24.
  std::vector<TrainingEpisode> tail;
  // The smoothed curve at 0, 8, 16 ... 504 and 511 511ths of the budget.
  std::vector<double> curve;
  std::optional<double> late_return;  // mean over the episodes that ended in the last tenth
};

// longest_episode: the environment's step limit.
TrainingCurve training_curve(std::span<const TrainingEpisode> episodes, double budget,
                             double longest_episode);

// The paper's statistic for one cell: for each seed the last of 512 points from the seeds' latest
// first episode to their earliest last one. None if a seed finished no episode.
std::optional<std::vector<double>> last_points(std::span<const TrainingCurve> seeds);

}  // namespace agail
