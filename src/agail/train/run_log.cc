#include "agail/train/run_log.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace agail {

namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

struct Row {
  const UpdateReport& report;
  const Stopwatch& stopwatch;
  const std::optional<Evaluation>& evaluation;
  double elapsed, steps_per_second;

  double trpo(double TrpoReport::*field) const {
    return report.trpo ? (*report.trpo).*field : kAbsent;
  }
  double discriminator(double DiscriminatorReport::*field) const {
    return report.imitation && report.imitation->discriminator
               ? (*report.imitation->discriminator).*field
               : kAbsent;
  }
  double guide(double GuideReport::*field) const {
    return report.imitation && report.imitation->guide ? (*report.imitation->guide).*field
                                                       : kAbsent;
  }
};

struct Column {
  const char* name;
  double (*value)(const Row&);
};

// One line a column; the order of progress.csv.
const std::vector<Column>& columns() {
  static const std::vector<Column> table = {
      {"time/total_timesteps",
       [](const Row& r) { return static_cast<double>(r.report.timesteps); }},
      {"time/iterations", [](const Row& r) { return static_cast<double>(r.report.update); }},
      {"time/time_elapsed", [](const Row& r) { return r.elapsed; }},
      {"time/fps", [](const Row& r) { return r.steps_per_second; }},
      {"time/physics", [](const Row& r) { return r.stopwatch.seconds(Phase::kPhysics); }},
      {"time/learning",
       [](const Row& r) {
         double sum = 0;
         for (std::size_t p = 1; p < static_cast<std::size_t>(Phase::kCount); ++p)
           sum += r.stopwatch.seconds(static_cast<Phase>(p));
         return sum;
       }},
      {"rollout/ep_rew_mean", [](const Row& r) { return r.report.episode_return; }},
      {"rollout/ep_len_mean", [](const Row& r) { return r.report.episode_length; }},
      {"rollout/episodes", [](const Row& r) { return static_cast<double>(r.report.episodes); }},
      {"rollout/diverged", [](const Row& r) { return static_cast<double>(r.report.diverged); }},
      {"eval/mean_reward",
       [](const Row& r) { return r.evaluation ? r.evaluation->mean_return() : kAbsent; }},
      {"eval/mean_ep_length",
       [](const Row& r) { return r.evaluation ? r.evaluation->mean_length() : kAbsent; }},
      {"train/kl_divergence_loss", [](const Row& r) { return r.trpo(&TrpoReport::kl); }},
      {"train/entropy", [](const Row& r) { return r.trpo(&TrpoReport::entropy); }},
      {"train/policy_objective", [](const Row& r) { return r.trpo(&TrpoReport::improvement); }},
      {"train/gradient_norm", [](const Row& r) { return r.trpo(&TrpoReport::gradient_norm); }},
      {"train/is_line_search_success",
       [](const Row& r) {
         return r.report.trpo ? (r.report.trpo->accepted ? 1.0 : 0.0) : kAbsent;
       }},
      {"train/std",
       [](const Row& r) { return r.report.mean_std > 0 ? r.report.mean_std : kAbsent; }},
      {"train/explained_variance",
       [](const Row& r) { return r.report.explained_variance.value_or(kAbsent); }},
      {"discriminator/loss",
       [](const Row& r) { return r.discriminator(&DiscriminatorReport::loss); }},
      {"discriminator/policy_accuracy",
       [](const Row& r) { return r.discriminator(&DiscriminatorReport::policy_accuracy); }},
      {"discriminator/demo_accuracy",
       [](const Row& r) { return r.discriminator(&DiscriminatorReport::demo_accuracy); }},
      {"discriminator/gradient_penalty",
       [](const Row& r) { return r.discriminator(&DiscriminatorReport::gradient_penalty); }},
      {"discriminator/reward",
       [](const Row& r) {
         return r.report.imitation ? r.report.imitation->discriminator_reward : kAbsent;
       }},
      {"guide/loss", [](const Row& r) { return r.guide(&GuideReport::loss); }},
      {"guide/held_out_log_likelihood",
       [](const Row& r) { return r.guide(&GuideReport::held_out_log_likelihood); }},
      {"guide/action_variance_share",
       [](const Row& r) { return r.guide(&GuideReport::action_variance_share); }},
      {"guide/reward",
       [](const Row& r) {
         return r.report.imitation && r.report.imitation->has_guide
                    ? r.report.imitation->guide_reward
                    : kAbsent;
       }},
      {"clone/log_likelihood",
       [](const Row& r) { return r.report.clone_log_likelihood.value_or(kAbsent); }},
      {"clone/quality",
       [](const Row& r) { return r.report.bco ? r.report.bco->cloning.quality : kAbsent; }},
      {"inverse_dynamics/quality",
       [](const Row& r) {
         return r.report.bco ? r.report.bco->inverse_dynamics.quality : kAbsent;
       }},
  };
  return table;
}

}  // namespace

std::vector<std::string> progress_columns() {
  std::vector<std::string> names;
  for (const Column& column : columns()) names.emplace_back(column.name);
  return names;
}

std::vector<std::string> episode_columns() { return {"timesteps", "length", "return"}; }

RunLog::RunLog(const std::filesystem::path& folder, std::int64_t total_timesteps,
               std::optional<std::int64_t> resume_step, bool shown)
    : total_timesteps_(total_timesteps),
      first_timesteps_(resume_step.value_or(0)),
      visible_(shown),
      terminal_(isatty(STDERR_FILENO) == 1),
      csv_(folder / "progress.csv", progress_columns()),
      episodes_(folder / "episodes.csv", episode_columns()),
      events_(folder, resume_step) {
  csv_.truncate_after("time/total_timesteps", static_cast<double>(first_timesteps_));
  episodes_.truncate_after("timesteps", static_cast<double>(first_timesteps_));
}

std::vector<double> RunLog::update(const UpdateReport& report,
                                   std::span<const FinishedEpisode> finished,
                                   const Stopwatch& stopwatch,
                                   const std::optional<Evaluation>& evaluation) {
  const double elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
  const double steps_per_second =
      static_cast<double>(report.timesteps - first_timesteps_) / std::max(elapsed, 1e-9);
  if (evaluation) evaluated_return_ = evaluation->mean_return();
  const Row row{report, stopwatch, evaluation, elapsed, steps_per_second};
  std::vector<double> values;
  std::vector<std::pair<std::string_view, double>> scalars;
  for (const Column& column : columns()) {
    values.push_back(column.value(row));
    scalars.emplace_back(column.name, values.back());
  }
  csv_.row(values);
  std::vector<double> episodes;
  for (const FinishedEpisode& episode : finished)
    for (const double value :
         {static_cast<double>(report.timesteps), episode.length, episode.episode_return})
      episodes.push_back(value);
  episodes_.rows(episodes);
  events_.scalars(report.timesteps, scalars);

  // A bar moves ten times a second; lines come every ten seconds.
  const double since = std::chrono::duration<double>(Clock::now() - shown_).count();
  if (since > (terminal_ ? 0.1 : 10.0) || report.timesteps >= total_timesteps_)
    show(report, steps_per_second);
  return values;
}

void RunLog::show(const UpdateReport& report, double steps_per_second) {
  shown_ = Clock::now();
  events_.flush();
  if (!visible_) return;
  const double share =
      std::min(1.0, static_cast<double>(report.timesteps) / static_cast<double>(total_timesteps_));
  const auto left = static_cast<std::int64_t>(std::clamp(
      static_cast<double>(total_timesteps_ - report.timesteps) / steps_per_second, 0.0, 1e15));
  char evaluated[48] = "";
  if (evaluated_return_)
    std::snprintf(evaluated, sizeof evaluated, "  evaluated %.1f", *evaluated_return_);
  char line[200];
  std::snprintf(line, sizeof line,
                "%9lld/%lld steps  %6.0f steps/s  return %.1f%s  left %lld:%02lld",
                static_cast<long long>(report.timesteps), static_cast<long long>(total_timesteps_),
                steps_per_second, report.episode_return, evaluated,
                static_cast<long long>(left / 60), static_cast<long long>(left % 60));
  if (terminal_) {
    constexpr int kWidth = 24;
    const int full = static_cast<int>(share * kWidth);
    std::string bar(static_cast<std::size_t>(full), '#');
    bar.resize(kWidth, '.');
    std::fprintf(stderr, "\r[%s] %s\x1b[K", bar.c_str(), line);
    bar_open_ = true;
  } else {
    std::fprintf(stderr, "%3.0f %%  %s\n", 100 * share, line);
  }
  std::fflush(stderr);
}

void RunLog::finish() {
  events_.flush();
  if (bar_open_) std::fputc('\n', stderr);
  bar_open_ = false;
}

}  // namespace agail
