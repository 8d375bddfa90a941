#include "agail/train/run.h"

#include <chrono>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "agail/base/atomic_file.h"
#include "agail/base/build_info.h"
#include "agail/base/interrupt.h"
#include "agail/train/checkpoint.h"
#include "agail/train/run_log.h"

namespace agail {

namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

// A file that write_file_atomically was killed over.
bool is_unfinished(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.starts_with('.') && name.ends_with(".tmp");
}

void remove_unfinished_files(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (is_unfinished(entry.path())) fs::remove(entry.path());
}

// What a run that was cut off before it began leaves behind: an empty checkpoints/ and unfinished
// temporary files.
bool holds_other_files(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const bool left_behind =
        (entry.path().filename() == "checkpoints" && fs::is_empty(entry.path())) ||
        is_unfinished(entry.path());
    if (!left_behind) return true;
  }
  return false;
}

void check_folder(const fs::path& folder, bool resume) {
  const bool has_run = fs::exists(folder / "config.toml");
  if (has_run && !resume)
    throw InputError(folder.string() +
                     ": there is a run in this folder; go on with --resume, or give another --out");
  if (!has_run && fs::is_directory(folder) && holds_other_files(folder))
    throw InputError(folder.string() + ": the folder holds other files; give --out a new folder");
}

void write_summary(const fs::path& folder, const Trainer& trainer, const RunOutcome& outcome,
                   double wall_seconds) {
  const TrainingTask& task = trainer.task();
  nlohmann::ordered_json summary = {{"environment", task.environment},
                                    {"method", task.method},
                                    {"seed", task.seed},
                                    {"timesteps", outcome.timesteps},
                                    {"finished", outcome.signal == 0}};
  const auto add = [&](const char* name, const std::optional<Evaluation>& evaluation) {
    if (!evaluation || evaluation->returns.empty()) return;
    summary[name] = {{"episodes", evaluation->returns.size()},
                     {"mean_return", evaluation->mean_return()},
                     {"standard_error", evaluation->standard_error()},
                     {"mean_length", evaluation->mean_length()}};
  };
  add("cloned_evaluation", outcome.cloned);
  add("best_evaluation", outcome.best);
  add("last_evaluation", outcome.last);
  const auto regression = [&](const char* name, const std::optional<RegressionReport>& report) {
    if (report)
      summary[name] = {{"epochs", report->epochs},
                       {"best_epoch", report->best_epoch},
                       {"validation_loss", report->validation_loss},
                       {"held_out_quality", report->quality}};
  };
  regression("inverse_dynamics", trainer.inverse_dynamics());
  regression("cloning", trainer.cloning());
  if (task.demonstrations) {
    summary["demonstrations"] = {{"episodes", task.demonstrations->episodes.size()},
                                 {"transitions", task.demonstrations->transitions()},
                                 {"missing_ratio", task.demonstrations->missing_ratio()}};
    if (task.demonstrations->has_rewards())
      summary["demonstrations"]["mean_return"] = task.demonstrations->mean_return();
  }
  summary["version"] = kVersion;
  summary["mujoco"] = physics_version();
  summary["cpu"] = cpu_features();
  summary["threads"] = task.threads;
  summary["ranks"] = 1;
  summary["wall_seconds"] = wall_seconds;
  write_file_atomically(folder / "summary.json", summary.dump(2) + "\n");
}

// How good the fits before the first update were, on what they had not seen.
void tell_start(const Trainer& trainer) {
  const char* measure =
      environment_spec(trainer.task().environment).action.discrete ? "right" : "R^2";
  if (trainer.inverse_dynamics())
    std::fprintf(stderr, "missing actions inferred (inverse dynamics, held-out %s %.3f)\n", measure,
                 trainer.inverse_dynamics()->quality);
  if (trainer.cloning())
    std::fprintf(stderr, "policy cloned (held-out %s %.3f)\n", measure, trainer.cloning()->quality);
}

}  // namespace

RunOutcome run_training(TrainingTask task, const fs::path& folder, bool resume) {
  const Clock::time_point begin = Clock::now();
  const RunSettings run = task.settings.run;
  check_folder(folder, resume);
  InterruptGuard guard;
  Trainer trainer(
      std::move(task));  // a task that makes no sense ends here, and leaves nothing behind
  RunOutcome outcome;
  outcome.signal = interrupted();
  if (outcome.signal != 0) return outcome;
  create_output_folder(folder);
  create_output_folder(folder / "checkpoints");
  remove_unfinished_files(folder);
  remove_unfinished_files(folder / "checkpoints");
  const bool selects_best =
      trainer.task().method == "trpo";  // an imitator has no true reward to select by

  double best_return = -std::numeric_limits<double>::max();
  const CheckpointFile checkpoint(folder, trainer.task());
  const bool resumed = resume && checkpoint.load(trainer, best_return);
  tell_start(trainer);
  write_file_atomically(folder / "config.toml", trainer.task().settings_toml);
  RunLog log(folder, run.timesteps, resumed ? std::optional(trainer.timesteps()) : std::nullopt);

  const auto evaluate_now = [&] {
    const SavedPolicy policy = trainer.policy();
    outcome.last =
        evaluate(policy, run.evaluation_episodes, trainer.task().seed, false, trainer.pool());
    if (selects_best && outcome.last->mean_return() > best_return) {
      best_return = outcome.last->mean_return();
      outcome.best = outcome.last;
      policy.save(folder / "policy_best.safetensors");
    }
    return outcome.last;
  };

  if (trainer.cloning() && trainer.learns_by_interaction() && !resumed && run.evaluate_every > 0)
    outcome.cloned = evaluate_now();

  std::int64_t saved_timesteps = -1;
  const auto save = [&] {
    log.flush();  // what the checkpoint has seen is in the log
    checkpoint.save(trainer, best_return);
    saved_timesteps = trainer.timesteps();
  };
  // An interrupt waits for the update and its evaluation: a second or so.
  while (!trainer.finished() && interrupted() == 0) {
    const UpdateReport report = trainer.update();
    std::optional<Evaluation> evaluation;
    if (run.evaluate_every > 0 && (report.update % run.evaluate_every == 0 || trainer.finished()))
      evaluation = evaluate_now();
    log.update(report, trainer.stopwatch(), evaluation);
    if (report.update % run.checkpoint_every == 0 || trainer.finished()) save();
  }
  if (trainer.learns_by_interaction() && saved_timesteps != trainer.timesteps()) save();
  if (!trainer.learns_by_interaction() && interrupted() == 0) evaluate_now();
  log.finish();

  outcome.signal = interrupted();
  outcome.timesteps = trainer.timesteps();
  trainer.policy().save(folder / "policy.safetensors");
  write_summary(folder, trainer, outcome,
                std::chrono::duration<double>(Clock::now() - begin).count());
  return outcome;
}

}  // namespace agail
