#include "agail/demos/demonstrations_summary.h"

#include <cmath>
#include <iterator>
#include <span>

#include "agail/base/crc32c.h"

namespace agail {
namespace {

template <class T>
std::span<const std::uint8_t> bytes_of(const T* values, std::size_t count) {
  return {reinterpret_cast<const std::uint8_t*>(values), count * sizeof(T)};
}

std::uint32_t fingerprint_of(const Demonstrations& demonstrations) {
  std::uint32_t crc = 0;
  const auto add = [&crc](const auto* values, auto count) {
    crc = crc32c(bytes_of(values, static_cast<std::size_t>(count)), crc);
  };
  for (const DemoEpisode& episode : demonstrations.episodes) {
    const std::int64_t sizes[] = {episode.steps(), episode.observations.cols(),
                                  episode.actions.cols()};
    add(sizes, std::size(sizes));
    add(episode.observations.data(), episode.observations.size());
    add(episode.available.data(), episode.available.size());
    for (Eigen::Index i = 0; i < episode.actions.size(); ++i)
      if (episode.available.data()[i] != 0) add(episode.actions.data() + i, 1);
    add(episode.rewards.data(), episode.rewards.size());
    add(episode.terminations.data(), episode.terminations.size());
    add(episode.truncations.data(), episode.truncations.size());
  }
  return crc;
}

}  // namespace

DemonstrationsSummary summarise(const Demonstrations& demonstrations) {
  DemonstrationsSummary summary;
  summary.episodes = demonstrations.episodes.size();
  summary.transitions = demonstrations.transitions();
  summary.missing_ratio = demonstrations.missing_ratio();
  // Finite rewards can have an infinite sum.
  if (demonstrations.has_rewards()) {
    const double mean_return = demonstrations.mean_return();
    if (std::isfinite(mean_return)) summary.mean_return = mean_return;
  }
  summary.fingerprint = fingerprint_of(demonstrations);
  return summary;
}

}  // namespace agail
