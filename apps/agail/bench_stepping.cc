#include "bench_stepping.h"

#include <chrono>

#include "agail/comm/collectives.h"
#include "agail/comm/together.h"

namespace agail {
namespace {

void draw_actions(const ActionSpace& space, RandomStream random, Matrix<float>& actions) {
  for (Index j = 0; j < actions.cols(); ++j)
    for (Index i = 0; i < actions.rows(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      actions(i, j) = space.discrete
                          ? static_cast<float>(random.below(static_cast<std::uint32_t>(space.n)))
                          : static_cast<float>(random.uniform(static_cast<double>(space.low[k]),
                                                              static_cast<double>(space.high[k])));
    }
}

}  // namespace

nlohmann::ordered_json measure_stepping(const TrainingTask& task, int batches,
                                        Communicator& communicator) {
  using Clock = std::chrono::steady_clock;
  const RunSettings& run = task.settings.run;
  ThreadPool pool(task.threads);
  std::unique_ptr<Collector> collector;
  together(communicator, [&] {
    collector = std::make_unique<Collector>(task.environment, run.lanes, task.seed,
                                            Team(pool, communicator));
  });
  const EnvironmentSpec& spec = collector->spec();
  Batch batch(spec.observation_dim, spec.action.dim, run.lanes, run.batch_steps / run.lanes);
  const ActionSpace actions = ActionUnits(spec.action).space();
  constexpr int kWarmUp = 3;
  double seconds = 0;
  for (int i = 0; i < kWarmUp + batches; ++i) {
    draw_actions(actions,
                 RandomStream(task.seed, Purpose::kDiagnostics, 1, static_cast<std::uint32_t>(i)),
                 batch.actions);
    largest(communicator, 0);  // all start together, and the slowest rank's time counts
    const Clock::time_point start = Clock::now();
    collector->replay(batch);
    largest(communicator, 0);
    if (i >= kWarmUp) seconds += std::chrono::duration<double>(Clock::now() - start).count();
  }
  const double samples = static_cast<double>(batches) * static_cast<double>(batch.size());
  return {{"environment", task.environment},
          {"actions", "uniform"},
          {"samples", samples},
          {"lanes", run.lanes},
          {"threads", task.threads},
          {"ranks", communicator.ranks()},
          {"stepping_us", 1e6 * seconds / samples}};
}

}  // namespace agail
