// agail bench: what training costs over pure stepping.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "agail/comm/collectives.h"
#include "agail/comm/together.h"
#include "agail/demos/mask.h"
#include "agail/train/task_request.h"
#include "bench_demos.h"
#include "bench_stepping.h"
#include "commands.h"
#include "option_checks.h"
#include "peak.h"

namespace agail {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

// The most memory that this process has had at a time.
std::int64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024 * static_cast<std::int64_t>(usage.ru_maxrss);
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Options {
  std::vector<std::string> environments;
  std::string method = "agail", preset = "paper";
  std::vector<std::string> assignments;
  double missing = 0.5;
  std::int64_t demonstrations = 0;
  int updates = 60, threads = 1;
  bool only_stepping = false, json = false;
};

TrainingTask make_task(const Options& options, const std::string& environment) {
  TrainingTask task = make_training_task({.environment = environment,
                                          .method = options.method,
                                          .preset = options.preset,
                                          .assignments = options.assignments,
                                          .threads = options.threads});
  if (task.method == "bc" && !options.only_stepping)
    throw InputError("--method bc makes no updates that could be measured; give another method");
  if (options.method == "trpo" || options.only_stepping) return task;
  // What demonstrations show does not matter to what learning from them costs.
  Demonstrations demos = untrained_demonstrations(task, options.demonstrations);
  remove_actions(
      demos, {.pattern = MaskPattern::kStep, .ratio = options.missing, .seed = 0, .dimension = {}});
  task.demonstrations = std::move(demos);
  return task;
}

// What was measured, summed over the updates.
struct Measured {
  double training = 0, stepping = 0;  // seconds
  std::array<double, kPhaseNames.size()> seconds{};
  std::array<std::int64_t, kPhaseNames.size()> flops{};
  Traffic traffic;  // of the updates, not of copying the state
};

// Alternates: an update of training, then the same actions replayed by a second collector from the
// same state.
Measured alternate(const Options& options, Trainer& trainer) {
  Communicator& communicator = trainer.team().communicator();
  ThreadPool replay_pool(options.threads);
  Collector replayed(trainer.task().environment, trainer.task().settings.run.lanes,
                     trainer.task().seed, Team(replay_pool, communicator));
  constexpr int kWarmUp = 3;
  Measured sums;
  Stopwatch before = trainer.stopwatch();
  for (int i = 0; i < kWarmUp + options.updates; ++i) {
    if (i == kWarmUp) {
      sums = {};
      before = trainer.stopwatch();
    }
    TensorStore state;
    Archive saving(state, Archive::Mode::kSave);
    trainer.collector().archive(saving);
    Archive loading(state, Archive::Mode::kLoad);
    replayed.archive(loading);

    const Traffic traffic = communicator.traffic();
    Clock::time_point start = Clock::now();
    trainer.update();
    sums.training += seconds_since(start);
    sums.traffic += communicator.traffic() - traffic;
    start = Clock::now();
    replayed.replay(trainer.batch());
    largest(communicator, 0);  // the slowest rank's time counts
    sums.stepping += seconds_since(start);
  }
  for (std::size_t p = 0; p < kPhaseNames.size(); ++p) {
    const auto phase = static_cast<Phase>(p);
    sums.seconds[p] = trainer.stopwatch().seconds(phase) - before.seconds(phase);
    sums.flops[p] = trainer.stopwatch().flops(phase) - before.flops(phase);
  }
  return sums;
}

ordered_json measure(const Options& options, Trainer& trainer) {
  Communicator& communicator = trainer.team().communicator();
  const Measured sums = alternate(options, trainer);
  const auto updates = static_cast<double>(options.updates);
  const double samples = updates * static_cast<double>(trainer.batch().size());
  const auto microseconds = [&](double seconds) { return 1e6 * seconds / samples; };
  ordered_json split, gflops;
  for (std::size_t p = 0; p < kPhaseNames.size(); ++p) {
    split[kPhaseNames[p]] = microseconds(sums.seconds[p]);
    if (sums.flops[p] > 0)
      gflops[kPhaseNames[p]] = 1e-9 * static_cast<double>(sums.flops[p]) / sums.seconds[p];
  }
  const SavedPolicy policy = trainer.policy();
  ordered_json result = {{"environment", trainer.task().environment},
                         {"method", options.method},
                         {"preset", options.preset},
                         {"samples", samples},
                         {"threads", options.threads},
                         {"stepping_us", microseconds(sums.stepping)},
                         {"training_us", microseconds(sums.training)},
                         {"ratio", sums.training / sums.stepping},
                         {"split_us", split},
                         {"gflops", gflops},
                         {"peak_gflops", 1e-9 * peak_flops_per_second()},
                         {"peak_memory_bytes", peak_memory_bytes()},
                         {"signature", policy.signature()}};
  if (trainer.demonstrations())
    result["demonstration_transitions"] = trainer.demonstrations()->transitions;
  if (communicator.ranks() == 1) return result;
  const Traffic total = total_of(communicator, sums.traffic);
  result["ranks"] = communicator.ranks();
  result["parameters"] = policy.theta().size();
  result["traffic_an_update"] = {{"messages", static_cast<double>(total.messages) / updates},
                                 {"bytes", static_cast<double>(total.bytes) / updates},
                                 {"seconds_of_rank_0", sums.traffic.seconds / updates}};
  return result;
}

void run_stepping(const Options& options, Communicator& communicator) {
  ordered_json results = ordered_json::array();
  for (const std::string& environment : options.environments) {
    TrainingTask task;
    together(communicator, [&] { task = make_task(options, environment); });
    results.push_back(measure_stepping(task, options.updates, communicator));
    if (options.json) continue;
    std::printf("%s: stepping %.2f us under uniform actions, %d threads\n", environment.c_str(),
                results.back()["stepping_us"].get<double>(), options.threads);
  }
  if (options.json) std::cout << results.dump(2) << "\n";
}

void run(Options options, Communicator& communicator) {
  if (options.environments.empty())
    options.environments = {"Hopper-v5", "Walker2d-v5", "Humanoid-v4"};
  if (options.only_stepping) return run_stepping(options, communicator);
  ordered_json results = ordered_json::array();
  for (const std::string& environment : options.environments) {
    std::unique_ptr<Trainer> trainer;
    together(communicator, [&] {
      trainer = std::make_unique<Trainer>(make_task(options, environment), communicator);
    });
    or_abort(communicator, [&] { results.push_back(measure(options, *trainer)); });
    if (options.json) continue;
    const ordered_json& result = results.back();
    std::printf(
        "%s, %s, preset %s: stepping %.2f us, training %.2f us a sample, ratio %.3f, signature "
        "%s\n",
        environment.c_str(), options.method.c_str(), options.preset.c_str(),
        result["stepping_us"].get<double>(), result["training_us"].get<double>(),
        result["ratio"].get<double>(), result["signature"].get<std::string>().c_str());
    const auto peak = result["peak_gflops"].get<double>();
    for (const auto& [name, value] : result["split_us"].items()) {
      std::printf("  %-20s %8.3f us", name.c_str(), value.get<double>());
      if (result["gflops"].contains(name)) {
        const auto rate = result["gflops"][name].get<double>();
        std::printf("  %6.1f GFLOP/s in products, %2.0f %% of a core's peak", rate,
                    100 * rate / peak);
      }
      std::printf("\n");
    }
    if (result.contains("traffic_an_update"))
      std::printf("  %d ranks sent %.0f messages, %.0f bytes an update\n", communicator.ranks(),
                  result["traffic_an_update"]["messages"].get<double>(),
                  result["traffic_an_update"]["bytes"].get<double>());
    std::fflush(stdout);
  }
  if (options.json) std::cout << results.dump(2) << "\n";
}

}  // namespace

void add_bench(CLI::App& app, Communicator& communicator) {
  CLI::App* command =
      app.add_subcommand("bench", "Measure training against pure stepping of the physics");
  const auto options = std::make_shared<Options>();
  command->add_option("ENV", options->environments, "Default: Hopper-v5 Walker2d-v5 Humanoid-v4");
  command->add_option("--method", options->method, "Default agail");
  command->add_option("--preset", options->preset, "Default paper");
  command->add_option("--set", options->assignments, "key=value, for any setting")
      ->allow_extra_args(false);
  command->add_option("--missing", options->missing, "Share of missing actions, default 0.5")
      ->check(not_empty());
  command
      ->add_option("--demonstrations", options->demonstrations,
                   "Transitions of the demonstrations, default those of 100 episodes")
      ->check(positive());
  command->add_flag("--only-stepping", options->only_stepping,
                    "No training: step through uniformly random actions");
  command->add_option("--updates", options->updates, "Updates to measure, default 60")
      ->check(whole_number(1, 1'000'000'000));
  command->add_option("--threads", options->threads, "Default 1")->check(whole_number(1, 4096));
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, &communicator] { run(*options, communicator); });
}

}  // namespace agail
