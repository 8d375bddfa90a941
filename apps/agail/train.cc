// agail train: a policy from an environment's reward, or from demonstrations.
#include <iostream>
#include <memory>

#include "agail/base/atomic_file.h"
#include "agail/comm/together.h"
#include "agail/config/settings_reference.h"
#include "agail/demos/minari_reader.h"
#include "agail/train/run.h"
#include "agail/train/task_request.h"
#include "commands.h"
#include "option_checks.h"

namespace agail {
namespace {

struct Options : TaskRequest {
  std::string out, demos;
  bool resume = false;
};

// With --resume and no settings of its own, a run goes on with those that it was started with.
TaskRequest request_of(const Options& options, bool preset_given) {
  TaskRequest request = options;
  const std::filesystem::path config = std::filesystem::path(options.out) / "config.toml";
  if (options.resume && !preset_given && options.assignments.empty() && is_there(config))
    request.preset = config.string();
  return request;
}

TrainingTask make_task(const Options& options, bool preset_given, bool first_rank) {
  TrainingTask task = make_training_task(request_of(options, preset_given));
  if (!options.demos.empty()) task.demonstrations = read_demonstrations(options.demos);
  if (task.demonstrations && !task.demonstrations->environment.empty() &&
      task.demonstrations->environment != options.environment && first_rank)
    std::cerr << "agail: note: the demonstrations are of " << task.demonstrations->environment
              << ", training is on " << options.environment << "\n";
  return task;
}

void run(const Options& options, bool preset_given, Communicator& communicator) {
  const bool first_rank = communicator.rank() == 0;
  TrainingTask task;
  together(communicator, [&] { task = make_task(options, preset_given, first_rank); });
  const RunOutcome outcome =
      run_training(std::move(task), options.out, {.resume = options.resume}, communicator);
  if (outcome.signal != 0) {
    if (first_rank)
      std::cerr << "agail: stopped at " << outcome.timesteps << " steps; go on with --resume\n";
    throw Interrupted{outcome.signal};
  }
  const auto& [best, last] = outcome.evaluations;
  const std::optional<Evaluation>& shown = best ? best : last;
  std::cout << options.out;
  if (shown)
    std::cout << ": mean return " << shown->mean_return() << " over " << shown->returns.size()
              << " deterministic episodes" << (best ? " (best checkpoint)" : "");
  std::cout << "\n";
}

}  // namespace

void add_train(CLI::App& app, Communicator& communicator) {
  CLI::App* command = app.add_subcommand("train", "Train a policy");
  const auto options = std::make_shared<Options>();
  command->add_option("ENV", options->environment, "Environment id, see agail envs")->required();
  command->add_option("--method", options->method, training_method_names())->required();
  command->add_option("--out", options->out, "Run folder to create")
      ->required()
      ->check(not_empty());
  command->add_option(
      "--demos", options->demos,
      "Demonstrations: a .hdf5 file, a Minari dataset folder or a Minari dataset id");
  CLI::Option* preset =
      command->add_option("--preset", options->preset, "default, paper, or a .toml file");
  command->add_option("--set", options->assignments, "key=value, for any setting (may be repeated)")
      ->allow_extra_args(false);
  command
      ->add_option("--timesteps", options->timesteps,
                   "Stop after the first update at or past this many steps")
      ->check(positive());
  command->add_option("--seed", options->seed, "Names all random numbers")->check(any_seed());
  command
      ->add_option("--threads", options->threads,
                   "Of each rank; default: the cores of this machine or container")
      ->check(whole_number(1, 4096));
  command->add_option("--lanes", options->lanes, "Environments that collect a batch side by side")
      ->check(positive());
  command->add_flag("--resume", options->resume, "Go on with the run in --out");
  const auto print_and_exit = [command](const std::string& flag, std::string (*text)(),
                                        const std::string& help) {
    command->add_flag_callback(
        flag,
        [text] {
          std::cout << text();
          throw CLI::Success();
        },
        help);
  };
  print_and_exit("--help-settings", settings_help, "Print every setting and exit");
  print_and_exit("--help-settings-markdown", settings_markdown, "The same as the reference page");
  command->callback(
      [options, preset, &communicator] { run(*options, preset->count() > 0, communicator); });
}

}  // namespace agail
