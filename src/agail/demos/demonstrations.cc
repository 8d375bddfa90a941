#include "agail/demos/demonstrations.h"

#include <limits>

#include "agail/base/error.h"

namespace agail {

Eigen::Index first_row_beyond_float32(const RowMatrix<double>& values) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  for (Eigen::Index t = 0; t < values.rows(); ++t)
    if ((values.row(t).array().abs() > kLargest).any()) return t;
  return -1;
}

Eigen::Index Demonstrations::transitions() const {
  Eigen::Index sum = 0;
  for (const DemoEpisode& episode : episodes) sum += episode.steps();
  return sum;
}

double Demonstrations::missing_ratio() const {
  if (action.dim == 0) return transitions() > 0 ? 1.0 : 0.0;
  Eigen::Index entries = 0;
  Eigen::Index missing = 0;
  for (const DemoEpisode& episode : episodes) {
    entries += episode.available.size();
    missing += (episode.available.array() == 0).count();
  }
  return entries == 0 ? 0.0 : static_cast<double>(missing) / static_cast<double>(entries);
}

bool Demonstrations::has_rewards() const {
  for (const DemoEpisode& episode : episodes)
    if (episode.rewards.empty()) return false;
  return !episodes.empty();
}

double Demonstrations::mean_return() const {
  AGAIL_CHECK(has_rewards());
  double sum = 0;
  for (const DemoEpisode& episode : episodes)
    for (const double reward : episode.rewards) sum += reward;
  return sum / static_cast<double>(episodes.size());
}

}  // namespace agail
