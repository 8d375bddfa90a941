// agail reproduce: the paper's experiment.
#include <filesystem>
#include <iostream>
#include <memory>

#include "agail/base/atomic_file.h"
#include "agail/base/cpu_quota.h"
#include "agail/base/error.h"
#include "agail/comm/launch.h"
#include "agail/reproduce/grid.h"
#include "agail/reproduce/progress_display.h"
#include "agail/reproduce/table.h"
#include "commands.h"
#include "option_checks.h"

namespace agail {
namespace {

struct Options {
  std::string experiment, out, experts, shard;
  Experiment what;
  GridFilter filter;
  int jobs = 0;
  bool only_tables = false;
};

// "2/5" is the second of five parts. Under a launcher each process is a part.
Shard parse_shard(const std::string& text) {
  if (text.empty()) {
    if (const auto launched = launched_process()) return {launched->rank, launched->ranks};
    return {};
  }
  const auto slash = text.find('/');
  const auto digits = [](const std::string& s) {
    return !s.empty() && s.size() <= 4 && s.find_first_not_of("0123456789") == std::string::npos;
  };
  if (slash != std::string::npos && digits(text.substr(0, slash)) &&
      digits(text.substr(slash + 1))) {
    const Shard shard{std::stoi(text.substr(0, slash)) - 1, std::stoi(text.substr(slash + 1))};
    if (shard.index >= 0 && shard.index < shard.count) return shard;
  }
  throw InputError("--shard " + text + ": give part/parts, from 1/n to n/n");
}

void tell_tables(const std::filesystem::path& out) {
  const std::size_t runs = write_tables(out);
  std::cout << (out / "table.md").string() << ": " << runs << " runs\n";
}

void run(const Options& options) {
  namespace fs = std::filesystem;
  if (options.experiment != "table1")
    throw InputError("no experiment '" + options.experiment + "'; did you mean 'table1'?");
  const fs::path out = options.out;
  if (options.only_tables) {
    if (!is_there(out / "records") || !fs::is_directory(out / "records"))
      throw InputError(out.string() +
                       ": no records/ in this folder; give one that agail reproduce "
                       "has worked in");
    return tell_tables(out);
  }
  const Shard shard = parse_shard(options.shard);
  forget_launcher();  // the runs are single processes
  const fs::path experts = options.experts.empty() ? out / "experts" : fs::path(options.experts);
  const Grid grid = prepare_grid(options.what, options.filter, shard, out, experts);
  const int at_once = options.jobs > 0 ? options.jobs : default_threads();
  ProgressDisplay display(grid.cells, at_once);
  const JobsOutcome outcome = run_jobs(grid.jobs, at_once, display);
  display.finish(grid.jobs);
  if (outcome.signal != 0) {
    std::cerr << "agail: stopped; the same command goes on\n";
    throw Interrupted{outcome.signal};
  }
  tell_tables(out);
  if (outcome.failed > 0)
    throw SystemError(std::to_string(outcome.failed) + " of " + std::to_string(grid.jobs.size()) +
                      " jobs failed" +
                      (outcome.impossible > 0 ? ", and " + std::to_string(outcome.impossible) +
                                                    " that need them were not begun"
                                              : "") +
                      "; mend what their logs say, then the same command goes on");
}

}  // namespace

void add_reproduce(CLI::App& app) {
  CLI::App* command = app.add_subcommand("reproduce", "Run the paper's experiment");
  const auto options = std::make_shared<Options>();
  command->add_option("EXPERIMENT", options->experiment, "table1")->required();
  command
      ->add_option("--out", options->out,
                   "Folder of the experiment; the same command goes on with what is there")
      ->required()
      ->check(not_empty());
  command->add_option("--preset", options->what.preset, "default, paper, or a .toml file");
  command->add_option("--set", options->what.assignments, "key=value, for all runs but the experts")
      ->allow_extra_args(false);
  command
      ->add_option("--timesteps", options->what.timesteps,
                   "Of every run, the experts' too, in place of the environment's own")
      ->check(positive());
  command->add_option("--envs", options->filter.environments, "Only these environments");
  command->add_option("--methods", options->filter.methods,
                      "Only these of trpo gail state-gail agail");
  command->add_option("--missing", options->filter.missing,
                      "Only these of agail's 0 0.25 0.5 0.75");
  command->add_option("--seeds", options->filter.seeds, "In place of 0 1 2 3 4 5")
      ->check(any_seed());
  command
      ->add_option("--jobs", options->jobs,
                   "Runs at a time; default: the cores of this machine or container")
      ->check(whole_number(1, 4096));
  command->add_option("--shard", options->shard,
                      "i/n: part i of n (from 1), for several machines with a common --out");
  command->add_option("--experts", options->experts,
                      "Folder of the experts, which several --out may share; default: OUT/experts");
  command->add_flag("--only-tables", options->only_tables,
                    "Run nothing; compute the tables from what has been run");
  command->callback([options] { run(*options); });
}

}  // namespace agail
