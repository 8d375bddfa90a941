#include "agail/reproduce/grid.h"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/config/settings_file.h"
#include "agail/reproduce/child_process.h"
#include "agail/reproduce/demonstrations.h"
#include "agail/reproduce/record.h"
#include "agail/train/task_request.h"

namespace agail {

namespace {

namespace fs = std::filesystem;

// Whoever starts first writes what the folder is for; everyone else must want the same.
void claim(const fs::path& folder, const char* name, const std::string& description) {
  create_output_folder(folder);
  const fs::path file = folder / name;
  if (!is_there(file)) create_file_atomically(file, description);
  const std::vector<std::uint8_t> bytes = read_file(file);
  if (std::string(bytes.begin(), bytes.end()) != description)
    throw InputError(file.string() +
                     ": this folder was begun with another preset, --timesteps, --set or other "
                     "settings of the preset; give another folder");
}

double seconds(const std::string& environment, const Settings& settings) {
  return 1e-6 * table_environment(environment).step_microseconds *
         static_cast<double>(settings.run.timesteps);
}

class GridBuilder {
 public:
  GridBuilder(const Experiment& experiment, fs::path out, fs::path experts)
      : experiment_(experiment), out_(std::move(out)), experts_(std::move(experts)) {}

  Grid build(const std::vector<GridRun>& runs) {
    const auto cost = [&](const std::string& environment) {
      return seconds(environment, experiment_.settings(environment));
    };
    std::vector<std::string> environments;  // that need demonstrations
    for (const GridRun& run : runs)
      if (needs_demonstrations(run) && std::find(environments.begin(), environments.end(),
                                                 run.cell.environment) == environments.end())
        environments.push_back(run.cell.environment);
    std::stable_sort(environments.begin(), environments.end(),
                     [&](const std::string& a, const std::string& b) { return cost(a) > cost(b); });
    for (const std::string& environment : environments)
      if (!is_done(demonstrations_job(environment)))
        for (const std::uint64_t seed : kExpertSeeds) add_expert(environment, seed);
    for (const std::string& environment : environments) add_demonstrations(environment);
    for (const GridRun& run : runs) add_run(run);
    return std::move(grid_);
  }

 private:
  static fs::path record_file(const fs::path& folder, const std::string& id) {
    return folder / "records" / (id + ".json");
  }

  fs::path demonstrations_record(const std::string& environment) const {
    return record_file(out_, "demonstrations/" + environment);
  }

  std::size_t add(Job job, std::optional<Cell> cell = {}) {
    grid_.jobs.push_back(std::move(job));
    grid_.cells.push_back(std::move(cell));
    return grid_.jobs.size() - 1;
  }

  // `agail train ... --resume` goes on where an earlier process stopped.
  static std::vector<std::string> train(const std::string& environment, const std::string& method,
                                        const std::string& preset, std::uint64_t seed,
                                        const Settings& settings, const fs::path& run,
                                        std::vector<std::string> assignments = {}) {
    assignments.push_back("run.evaluate_every=" + std::to_string(settings.run.evaluate_every));
    std::vector<std::string> arguments = {
        "train",     environment, "--method",    method,
        "--preset",  preset,      "--seed",      std::to_string(seed),
        "--threads", "1",         "--timesteps", std::to_string(settings.run.timesteps),
        "--resume",  "--out",     run.string()};
    for (const std::string& assignment : assignments)
      arguments.insert(arguments.end(), {"--set", assignment});
    return arguments;
  }

  // Trains in runs/<id> of a folder; then `write_record` leaves `record`.
  static Job training_job(
      const fs::path& folder, const std::string& id, std::string title,
      const std::string& environment, const Settings& settings,
      const std::vector<std::string>& arguments,
      const std::function<void(const fs::path& record, const fs::path& run)>& write_record) {
    const fs::path run = folder / "runs" / id, record = record_file(folder, id);
    return {.title = std::move(title),
            .results = {record},
            .lock = folder / "locks" / id,
            .log = folder / "logs" / (id + ".log"),
            .needs = {},
            .steps = {[=] { return execute_ourselves(arguments); },
                      [=] {
                        write_record(record, run);
                        return 0;
                      }},
            .cost = seconds(environment, settings),
            .progress = run / "progress.csv",
            .timesteps = static_cast<double>(settings.run.timesteps)};
  }

  // Only where demonstrations are to be made, for which a record alone, as somebody may have
  // published it, does not do: they are made from the policy.
  void add_expert(const std::string& environment, std::uint64_t seed) {
    const std::string id = environment + "-" + std::to_string(seed);
    const Settings settings = experiment_.expert_settings(environment);
    const fs::path run = experts_ / "runs" / id, policy = run / "policy_best.safetensors";
    Job job = training_job(experts_, id, environment + " expert seed " + std::to_string(seed),
                           environment, settings,
                           train(environment, "trpo", kExpertPreset, seed, settings, run),
                           [=](const fs::path& record, const fs::path& folder) {
                             write_expert_record(record, folder, environment, seed);
                           });
    // While the policy is trained again, the record of the lost one must not say that it is done.
    job.steps.insert(job.steps.begin(), [policy, record = job.results.front()] {
      if (!is_there(policy)) fs::remove(record);
      return 0;
    });
    job.results.push_back(policy);
    expert_jobs_[environment].push_back(add(std::move(job)));
  }

  // A run that has left its record needs none; of its environment's, the tables need the record.
  bool needs_demonstrations(const GridRun& run) const {
    return run.cell.missing && !(is_there(record_file(out_, run.id())) &&
                                 is_there(demonstrations_record(run.cell.environment)));
  }

  void add_demonstrations(const std::string& environment) {
    Job job = demonstrations_job(environment);
    job.needs = expert_jobs_[environment];
    demonstration_jobs_[environment] = {add(std::move(job))};
  }

  Job demonstrations_job(const std::string& environment) const {
    DemonstrationPlan plan{.environment = environment,
                           .choice = experiment_.demonstrations(),
                           .candidate_records = {},
                           .candidate_runs = {},
                           .folder = out_ / "demonstrations" / environment,
                           .record = demonstrations_record(environment)};
    for (const std::uint64_t seed : kExpertSeeds) {
      const std::string id = environment + "-" + std::to_string(seed);
      plan.candidate_records.push_back(record_file(experts_, id));
      plan.candidate_runs.push_back(experts_ / "runs" / id);
    }
    return {.title = environment + " demonstrations",
            // A record alone may have been published, without what it describes.
            .results = {demonstrations_file(plan.folder, 1), plan.record},
            .lock = out_ / "locks" / ("demonstrations-" + environment),
            .log = out_ / "logs" / ("demonstrations-" + environment + ".log"),
            .needs = {},
            .steps = {[plan] {
              make_demonstrations(plan);
              return 0;
            }},
            .cost = 1,
            .progress = {},
            .timesteps = 0};
  }

  void add_run(const GridRun& run) {
    const std::string& environment = run.cell.environment;
    const Settings settings = experiment_.settings(environment);
    std::vector<std::string> arguments =
        train(environment, run.cell.method, experiment_.preset, run.seed, settings,
              out_ / "runs" / run.id(), experiment_.assignments);
    std::vector<std::size_t> needs;
    if (run.cell.missing) {
      const fs::path demos = out_ / "demonstrations" / environment;
      arguments.insert(arguments.end(),
                       {"--demos", demonstrations_file(demos, *run.cell.missing).string()});
      needs = demonstration_jobs_[environment];
    }
    Job job = training_job(
        out_, run.id(), run.title(), environment, settings, arguments,
        [run, experiment = experiment_](const fs::path& record, const fs::path& folder) {
          write_run_record(record, folder, run, experiment);
        });
    job.needs = needs;
    add(std::move(job), run.cell);
  }

  const Experiment& experiment_;
  fs::path out_, experts_;
  Grid grid_;
  std::map<std::string, std::vector<std::size_t>> expert_jobs_, demonstration_jobs_;
};

// The longest first, then every n-th: each part gets as much of each kind.
std::vector<GridRun> runs_of(const Experiment& experiment, const GridFilter& filter, Shard shard) {
  std::vector<GridRun> runs = grid_runs(filter);
  const auto cost = [&](const GridRun& run) {
    return seconds(run.cell.environment, experiment.settings(run.cell.environment));
  };
  std::stable_sort(runs.begin(), runs.end(),
                   [&](const GridRun& a, const GridRun& b) { return cost(a) > cost(b); });
  std::vector<GridRun> own;
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (i % static_cast<std::size_t>(shard.count) == static_cast<std::size_t>(shard.index))
      own.push_back(runs[i]);
  return own;
}

// What no run could use or would notice is told before the folder belongs to this experiment.
void check(const Experiment& experiment, const GridFilter& filter) {
  for (const std::string& text : experiment.assignments)
    if (parse_assignment(text).setting->name == "run.evaluate_every")
      throw InputError("--set " + text + ": every run is evaluated about " +
                       std::to_string(kEvaluationsOfARun) + " times; leave this setting out");
  for (const Cell& cell : table_cells(filter))
    check_settings(experiment.settings(cell.environment), cell.environment, cell.method);
}

}  // namespace

Grid prepare_grid(const Experiment& experiment, const GridFilter& filter, Shard shard,
                  const fs::path& out, const fs::path& experts) {
  const std::vector<GridRun> runs = runs_of(experiment, filter, shard);
  check(experiment, filter);
  claim(out, "experiment.json", experiment.description());
  for (const char* name : {"records/demonstrations", "runs", "demonstrations", "logs", "locks"})
    create_output_folder(out / name);
  claim(experts, "experts.json", experiment.expert_description());
  for (const char* name : {"records", "runs", "logs", "locks"})
    create_output_folder(experts / name);
  return GridBuilder(experiment, out, experts).build(runs);
}

}  // namespace agail
