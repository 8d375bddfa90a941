#include "agail/train/run.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "agail/base/atomic_file.h"
#include "agail/base/build_info.h"
#include "agail/base/file_lock.h"
#include "agail/base/interrupt.h"
#include "agail/comm/collectives.h"
#include "agail/comm/together.h"
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

// Other than what a run that was cut off before it began leaves behind: checkpoints/ without a
// checkpoint and unfinished temporary files.
bool holds_other_files(const fs::path& folder) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const bool left_behind =
        is_unfinished(entry.path()) || (entry.path().filename() == "checkpoints" &&
                                        entry.is_directory() && !holds_other_files(entry.path()));
    if (!left_behind) return true;
  }
  return false;
}

void check_folder(const fs::path& folder, bool resume) {
  const bool has_run = is_there(folder / "config.toml") || is_there(CheckpointFile::path(folder));
  if (has_run && !resume)
    throw InputError(folder.string() +
                     ": there is a run in this folder; go on with --resume, or give another --out");
  if (!has_run && holds_other_files(folder))
    throw InputError(folder.string() + ": the folder holds other files; give --out a new folder");
}

void write_summary(const fs::path& folder, const Trainer& trainer, const RunOutcome& outcome,
                   const Traffic& traffic, double wall_seconds) {
  const TrainingTask& task = trainer.task();
  nlohmann::ordered_json summary = {{"environment", task.environment},
                                    {"method", task.method},
                                    {"seed", task.seed},
                                    {"timesteps", outcome.timesteps},
                                    {"finished", outcome.signal == 0 && !outcome.stopped}};
  const auto add = [&](const char* name, const std::optional<Evaluation>& evaluation) {
    if (!evaluation || evaluation->returns.empty()) return;
    summary[name] = {{"episodes", evaluation->returns.size()},
                     {"mean_return", evaluation->mean_return()},
                     {"standard_error", evaluation->standard_error()},
                     {"mean_length", evaluation->mean_length()}};
  };
  add("cloned_evaluation", outcome.cloned);
  add("best_evaluation", outcome.evaluations.best);
  add("last_evaluation", outcome.evaluations.last);
  const auto regression = [&](const char* name, const std::optional<RegressionReport>& report) {
    if (report)
      summary[name] = {{"epochs", report->epochs},
                       {"best_epoch", report->best_epoch},
                       {"validation_loss", report->validation_loss},
                       {"held_out_quality", report->quality}};
  };
  regression("inverse_dynamics", trainer.inverse_dynamics());
  regression("cloning", trainer.cloning());
  if (const auto& demonstrations = trainer.demonstrations()) {
    summary["demonstrations"] = {{"episodes", demonstrations->episodes},
                                 {"transitions", demonstrations->transitions},
                                 {"missing_ratio", demonstrations->missing_ratio}};
    if (demonstrations->mean_return)
      summary["demonstrations"]["mean_return"] = *demonstrations->mean_return;
  }
  summary["version"] = kVersion;
  summary["mujoco"] = physics_version();
  summary["cpu"] = cpu_features();
  summary["threads"] = task.threads;
  summary["ranks"] = trainer.team().ranks();
  if (trainer.team().ranks() > 1)
    summary["traffic"] = {{"messages", traffic.messages},
                          {"bytes", traffic.bytes},
                          {"seconds_of_all_ranks", traffic.seconds}};
  summary["start_seconds"] = outcome.start_seconds;
  summary["wall_seconds"] = wall_seconds;
  write_file_atomically(folder / "summary.json", summary.dump(2) + "\n");
}

// How good the fits before the first update were, on what they had not seen.
void tell_start(const Trainer& trainer) {
  const char* measure =
      environment_spec(trainer.task().environment).action.discrete ? "right" : "R^2";
  const auto tell = [&](const char* what, const std::optional<RegressionReport>& report) {
    if (!report) return;
    if (std::isnan(report->quality))
      std::fprintf(stderr, "%s (nothing held out)\n", what);
    else
      std::fprintf(stderr, "%s (held-out %s %.3f)\n", what, measure, report->quality);
  };
  tell("missing actions inferred by inverse dynamics", trainer.inverse_dynamics());
  tell("policy cloned", trainer.cloning());
}

// Prepares, then trains. What only rank 0 does (files, the log) does not change the state.
class Run {
 public:
  Run(TrainingTask task, fs::path folder, RunOptions options, Communicator& communicator)
      : settings_(task.settings.run),
        folder_(std::move(folder)),
        options_(std::move(options)),
        communicator_(communicator),
        first_(communicator.rank() == 0) {
    together(communicator_, [&] {
      if (first_ && is_there(folder_) && fs::is_directory(folder_)) take_folder();
      // A task that makes no sense ends here, and leaves nothing behind.
      trainer_ = std::make_unique<Trainer>(std::move(task), communicator_);
    });
    outcome_.start_seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
  }

  // Everything before the first update; false if it is to stop.
  bool prepare();
  void train();
  const RunOutcome& outcome() const { return outcome_; }

 private:
  // On the first rank, once the folder exists: until this run ends nobody else trains in it.
  void take_folder() {
    if (lock_) return;
    lock_.emplace(folder_);
    if (!lock_->held())
      throw InputError(folder_.string() +
                       ": another agail is training in this folder; wait for its end, or give "
                       "another --out");
    check_folder(folder_, options_.resume);
  }
  // Whether any rank noted a signal or was told to stop, known to all: they must stop after the
  // same update.
  bool must_stop() {
    constexpr int kStopped = 1 << 16;  // above all signals
    if (outcome_.signal == 0 && !outcome_.stopped) {
      const int reason = largest(communicator_, told_to_stop_ ? kStopped : interrupted());
      outcome_.stopped = reason == kStopped;
      if (!outcome_.stopped) outcome_.signal = reason;
    }
    return outcome_.signal != 0 || outcome_.stopped;
  }
  std::optional<Evaluation> evaluate_now();
  void save();

  const Clock::time_point begin_ = Clock::now();
  InterruptGuard guard_;
  RunSettings settings_;
  fs::path folder_;
  RunOptions options_;
  bool told_to_stop_ = false;
  Communicator& communicator_;
  bool first_;  // the rank that writes
  std::optional<FolderLock> lock_;
  std::unique_ptr<Trainer> trainer_;
  std::optional<CheckpointFile> checkpoint_;
  std::optional<RunLog> log_;  // of the first rank
  RunOutcome outcome_;
  std::int64_t saved_timesteps_ = -1;
};

bool Run::prepare() {
  if (must_stop()) return false;
  checkpoint_.emplace(folder_, *trainer_);
  const int other = first_that_differs(communicator_, checkpoint_->fingerprint());
  together(communicator_, [&] {
    if (other >= 0)
      throw InputError(communicator_.name(other) +
                       " has other arguments, demonstrations, version " + "or CPU features than " +
                       communicator_.name(0) +
                       "; give all ranks the same program and files on machines of one kind");
    if (!first_) return;
    create_output_folder(folder_);
    take_folder();
    create_output_folder(folder_ / "checkpoints");
    remove_unfinished_files(folder_);
    remove_unfinished_files(folder_ / "checkpoints");
  });
  // Before a checkpoint replaces the start: a resumed run knows how good it was, too.
  if (trainer_->cloning() && trainer_->learns_by_interaction() && settings_.evaluate_every > 0)
    or_abort(communicator_, [&] {
      outcome_.cloned = evaluate(trainer_->policy(), settings_.evaluation_episodes,
                                 trainer_->task().seed, false, trainer_->team());
    });
  // From here on a resume with another task is refused: the start is a checkpoint, too.
  if (!options_.resume || !checkpoint_->load(*trainer_, outcome_.evaluations))
    or_abort(communicator_, [&] { checkpoint_->save(*trainer_, outcome_.evaluations); });
  saved_timesteps_ = trainer_->timesteps();
  together(communicator_, [&] {
    if (!first_) return;
    if (options_.shows_progress) tell_start(*trainer_);
    write_file_atomically(folder_ / "config.toml", trainer_->task().settings_toml);
    log_.emplace(folder_, settings_.timesteps,
                 options_.resume ? std::optional(trainer_->timesteps()) : std::nullopt,
                 options_.shows_progress);
  });
  return true;
}

std::optional<Evaluation> Run::evaluate_now() {
  const SavedPolicy policy = trainer_->policy();
  auto& [best, last] = outcome_.evaluations;
  last = evaluate(policy, settings_.evaluation_episodes, trainer_->task().seed, false,
                  trainer_->team());
  // An imitator has no true reward to select by.
  if (trainer_->task().method == "trpo" && (!best || last->mean_return() > best->mean_return())) {
    best = last;
    if (first_) policy.save(folder_ / "policy_best.safetensors");
  }
  return last;
}

void Run::save() {
  if (first_) log_->flush();  // what the checkpoint has seen is in the log
  checkpoint_->save(*trainer_, outcome_.evaluations);
  saved_timesteps_ = trainer_->timesteps();
}

void Run::train() {
  Trainer& trainer = *trainer_;
  // An interrupt waits for the update and its evaluation: a second or so.
  while (!trainer.finished() && !must_stop()) {
    const UpdateReport report = trainer.update();
    std::optional<Evaluation> evaluation;
    if (settings_.evaluate_every > 0 &&
        (report.update % settings_.evaluate_every == 0 || trainer.finished()))
      evaluation = evaluate_now();
    if (first_) {
      const std::vector<double> row =
          log_->update(report, trainer.batch().finished, trainer.stopwatch(), evaluation);
      if (options_.on_update && !options_.on_update(row)) told_to_stop_ = !trainer.finished();
    }
    if (report.update % settings_.checkpoint_every == 0 || trainer.finished()) save();
  }
  if (trainer.learns_by_interaction() && saved_timesteps_ != trainer.timesteps()) save();
  if (!trainer.learns_by_interaction() && !must_stop()) evaluate_now();

  must_stop();
  outcome_.timesteps = trainer.timesteps();
  const Settings& settings = trainer.task().settings;
  if (first_ && options_.shows_progress && trainer.task().method == "bco" &&
      outcome_.timesteps < settings.bco.every * settings.run.batch_steps)
    std::fprintf(
        stderr,
        "agail: note: this was less than bco's first round of %lld steps, so the policy is "
        "still random; give more timesteps, or lower bco.every or run.batch_steps\n",
        static_cast<long long>(settings.bco.every * settings.run.batch_steps));
  const Traffic traffic = total_of(communicator_, communicator_.traffic());
  if (!first_) return;
  log_->finish();
  trainer.policy().save(folder_ / "policy.safetensors");
  write_summary(folder_, trainer, outcome_, traffic,
                std::chrono::duration<double>(Clock::now() - begin_).count());
}

}  // namespace

RunOutcome run_training(TrainingTask task, const fs::path& folder, RunOptions options,
                        Communicator& communicator) {
  Run run(std::move(task), folder, std::move(options), communicator);
  if (!run.prepare()) return run.outcome();
  or_abort(communicator, [&] { run.train(); });
  return run.outcome();
}

}  // namespace agail
