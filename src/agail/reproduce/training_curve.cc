#include "agail/reproduce/training_curve.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "agail/train/csv_log.h"

namespace agail {

namespace {

constexpr double kTailSpacings = 24;  // e^-24 = 4e-11

// sum and count of one side at each position; both arrays ascending.
struct Weighted {
  double sum = 0, count = 0;
};

std::vector<Weighted> one_sided(const std::vector<double>& ends, const std::vector<double>& returns,
                                const std::vector<double>& positions, double spacing) {
  std::vector<Weighted> result;
  Weighted so_far;
  std::size_t next = 0;
  for (const double position : positions) {
    so_far.sum *= std::exp(-1.0);
    so_far.count *= std::exp(-1.0);
    for (; next < ends.size() && ends[next] <= position; ++next) {
      const double weight = std::exp(-(position - ends[next]) / spacing);
      so_far.sum += weight * returns[next];
      so_far.count += weight;
    }
    result.push_back(so_far);
  }
  return result;
}

// To four decimals: what a record needs, in few bytes.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

std::vector<double> mirrored(std::vector<double> values) {
  std::reverse(values.begin(), values.end());
  for (double& v : values) v = -v;
  return values;
}

}  // namespace

std::vector<TrainingEpisode> read_training_episodes(const std::filesystem::path& run) {
  std::vector<TrainingEpisode> episodes;
  double steps = 0;
  for (const auto& [length, episode_return] :
       read_columns(run / "episodes.csv", "length", "return"))
    episodes.push_back({steps += length, episode_return});
  return episodes;
}

std::vector<TrainingEpisode> moving_average(std::span<const TrainingEpisode> episodes, int radius) {
  std::vector<TrainingEpisode> result(episodes.begin(), episodes.end());
  const auto n = static_cast<std::ptrdiff_t>(episodes.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, i - radius);
    const std::ptrdiff_t last = std::min<std::ptrdiff_t>(n - 1, i + radius);
    double sum = 0;
    for (std::ptrdiff_t j = first; j <= last; ++j)
      sum += episodes[static_cast<std::size_t>(j)].episode_return;
    result[static_cast<std::size_t>(i)].episode_return =
        sum / static_cast<double>(last - first + 1);
  }
  return result;
}

std::vector<double> symmetric_moving_average(std::span<const TrainingEpisode> episodes, double low,
                                             double high, int points) {
  std::vector<double> ends, returns, positions;
  for (const TrainingEpisode& episode : episodes) {
    ends.push_back(episode.end);
    returns.push_back(episode.episode_return);
  }
  const double spacing = (high - low) / (points - 1);
  for (int i = 0; i < points; ++i) positions.push_back(i + 1 < points ? low + spacing * i : high);
  const std::vector<Weighted> before = one_sided(ends, returns, positions, spacing);
  std::reverse(returns.begin(), returns.end());
  const std::vector<Weighted> after =
      one_sided(mirrored(ends), returns, mirrored(positions), spacing);
  std::vector<double> result;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Weighted& later = after[after.size() - 1 - i];
    const double count = before[i].count + later.count;
    result.push_back(count > 0 ? (before[i].sum + later.sum) / count
                               : std::numeric_limits<double>::quiet_NaN());
  }
  return result;
}

TrainingCurve training_curve(std::span<const TrainingEpisode> episodes, double budget,
                             double longest_episode) {
  // Smoothed first and cut then, as the paper's were.
  std::vector<TrainingEpisode> smooth = moving_average(episodes, kPaperRadius);
  while (!smooth.empty() && smooth.back().end > budget) smooth.pop_back();
  TrainingCurve result;
  if (smooth.empty()) return result;
  result.episodes = static_cast<std::int64_t>(smooth.size());
  result.first_end = smooth.front().end;
  result.last_end = smooth.back().end;

  // Another seed's last episode ends less than one episode's length before this budget.
  const double spacing = budget / (kPaperPoints - 1);
  for (const TrainingEpisode& episode : smooth)
    if (episode.end >= result.last_end - longest_episode - kTailSpacings * spacing)
      result.tail.push_back({episode.end, rounded(episode.episode_return)});

  const std::vector<double> all = symmetric_moving_average(smooth, 0, budget, kPaperPoints);
  for (std::size_t i = 0; i + 1 < all.size(); i += kCurveStride)
    result.curve.push_back(rounded(all[i]));
  result.curve.push_back(rounded(all.back()));

  double sum = 0, count = 0;
  for (const TrainingEpisode& episode : episodes) {
    if (episode.end <= 0.9 * budget || episode.end > budget) continue;
    sum += episode.episode_return;
    count += 1;
  }
  if (count > 0) result.late_return = rounded(sum / count);
  return result;
}

std::optional<std::vector<double>> last_points(std::span<const TrainingCurve> seeds) {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  for (const TrainingCurve& seed : seeds) {
    if (seed.tail.empty()) return std::nullopt;
    low = std::max(low, seed.first_end);
    high = std::min(high, seed.last_end);
  }
  if (seeds.empty() || !(high > low)) return std::nullopt;
  const double spacing = (high - low) / (kPaperPoints - 1);
  std::vector<double> values;
  for (const TrainingCurve& seed : seeds) {
    double sum = 0, count = 0;
    for (const TrainingEpisode& episode : seed.tail) {
      const double weight =
          std::exp(-std::abs(episode.end - high) / spacing) * (episode.end == high ? 2 : 1);
      sum += weight * episode.episode_return;
      count += weight;
    }
    if (!(count > 0)) return std::nullopt;
    values.push_back(sum / count);
  }
  return values;
}

}  // namespace agail
