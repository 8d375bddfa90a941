// Small demonstrations to test with.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "agail/base/random.h"
#include "agail/demos/demonstrations.h"

namespace agail {

// Continuous, complete, with rewards. One episode for each of `lengths`.
inline Demonstrations sample(const std::vector<int>& lengths, int action_dim = 3,
                             int observation_dim = 4) {
  Demonstrations demonstrations;
  demonstrations.environment = "Hopper-v5";
  demonstrations.observation_dim = observation_dim;
  demonstrations.action.dim = action_dim;
  demonstrations.action.low.assign(static_cast<std::size_t>(action_dim), -1.0F);
  demonstrations.action.high.assign(static_cast<std::size_t>(action_dim), 1.0F);
  RandomStream random(1, Purpose::kDiagnostics);
  for (const int steps : lengths) {
    DemoEpisode episode;
    episode.observations =
        RowMatrix<double>::NullaryExpr(steps + 1, observation_dim, [&] { return random.normal(); });
    episode.actions = RowMatrix<double>::NullaryExpr(steps, action_dim, [&] {
      return static_cast<double>(static_cast<float>(random.uniform(-1, 1)));
    });
    episode.available.setOnes(steps, action_dim);
    episode.rewards.assign(static_cast<std::size_t>(steps), 1.25);
    episode.terminations.assign(static_cast<std::size_t>(steps), 0);
    episode.truncations = episode.terminations;
    episode.terminations.back() = 1;
    demonstrations.episodes.push_back(episode);
  }
  return demonstrations;
}

inline Demonstrations discrete_sample(const std::vector<int>& lengths) {
  Demonstrations demonstrations = sample(lengths, 1);
  demonstrations.environment = "CartPole-v1";
  demonstrations.action = {.discrete = true, .dim = 1, .n = 2, .low = {}, .high = {}};
  demonstrations.observations_are_float32 = true;
  for (DemoEpisode& episode : demonstrations.episodes) {
    episode.actions = episode.actions.unaryExpr([](double a) { return a > 0 ? 1.0 : 0.0; });
    episode.observations = episode.observations.unaryExpr(
        [](double o) { return static_cast<double>(static_cast<float>(o)); });
  }
  return demonstrations;
}

// An empty folder of this test's own, removed again.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string form = (std::filesystem::temp_directory_path() / "agail-demos-XXXXXX").string();
    path_ = mkdtemp(form.data());
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace agail
