#include "bench_demos.h"

#include <algorithm>
#include <cmath>

#include "agail/train/evaluation.h"

namespace agail {
namespace {

constexpr double kNoise = 0.01;  // times the standard deviation of each number

Vector<double> deviations(const Demonstrations& demos) {
  Vector<double> sum = Vector<double>::Zero(demos.observation_dim), squares = sum;
  double rows = 0;
  for (const DemoEpisode& episode : demos.episodes) {
    sum += episode.observations.colwise().sum().transpose();
    squares += episode.observations.colwise().squaredNorm().transpose();
    rows += static_cast<double>(episode.observations.rows());
  }
  return (squares / rows - (sum / rows).cwiseAbs2()).cwiseMax(0).cwiseSqrt();
}

// The first `steps` steps.
void cut(DemoEpisode& episode, Index steps) {
  const auto size = static_cast<std::size_t>(steps);
  episode.observations.conservativeResize(steps + 1, Eigen::NoChange);
  episode.actions.conservativeResize(steps, Eigen::NoChange);
  episode.available.conservativeResize(steps, Eigen::NoChange);
  episode.rewards.resize(size);
  episode.terminations.resize(size);
  episode.truncations.resize(size);
}

void resize(Demonstrations& demos, Index transitions) {
  const Vector<double> noise = kNoise * deviations(demos);
  const std::vector<DemoEpisode> recorded = std::move(demos.episodes);
  demos.episodes.clear();
  Index left = transitions;
  for (std::size_t i = 0; left > 0; ++i) {
    DemoEpisode episode = recorded[i % recorded.size()];
    RandomStream random(0, Purpose::kDiagnostics, 0, static_cast<std::uint32_t>(i));
    if (i >= recorded.size())
      for (Index t = 0; t < episode.observations.rows(); ++t)
        for (Index k = 0; k < episode.observations.cols(); ++k)
          episode.observations(t, k) += noise[k] * random.uniform(-1, 1);
    if (episode.steps() > left) cut(episode, left);
    left -= episode.steps();
    demos.episodes.push_back(std::move(episode));
  }
}

}  // namespace

Demonstrations untrained_demonstrations(const TrainingTask& task, Index transitions) {
  TrainingTask plain = task;
  plain.method = "trpo";
  const Trainer untrained(std::move(plain));
  ThreadPool pool(1);
  Demonstrations demos = record(untrained.policy(), 100, 0, true, pool);
  if (transitions > 0) resize(demos, transitions);
  return demos;
}

}  // namespace agail
