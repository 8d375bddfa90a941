// The one training loop. Methods differ in where the reward comes from (environment | discriminator
// | discriminator and guide), in how the policy starts, and in a cloning term of its objective; bco
// clones instead of taking policy steps, as agail does at first where a dimension of the actions is
// known nowhere.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "agail/base/stopwatch.h"
#include "agail/demos/demonstrations_summary.h"
#include "agail/imitation/agail.h"
#include "agail/imitation/bco.h"
#include "agail/imitation/behavior_cloning.h"
#include "agail/imitation/inverse_dynamics.h"
#include "agail/rl/advantage.h"
#include "agail/rl/trpo.h"
#include "agail/train/saved_policy.h"

namespace agail {

struct TrainingTask {
  std::string environment;
  std::string method;  // of training_methods() in task_request.h
  Settings settings;
  std::string settings_toml;
  std::uint64_t seed = 0;
  int threads = 1;
  std::optional<Demonstrations> demonstrations;  // all methods but trpo; a Trainer takes them
};

// What one update did. Parts that do not exist are absent.
struct UpdateReport {
  std::int64_t update = 0;     // number of updates so far
  std::int64_t timesteps = 0;  // environment steps so far
  double episode_return =
      0;  // mean over the last 100 finished training episodes; NaN before the first
  double episode_length = 0;
  std::int64_t episodes = 0;                 // finished so far
  std::int64_t diverged = 0;                 // of these, ended by a broken simulation
  std::optional<TrpoReport> trpo;            // absent while only the value network learns
  std::optional<double> explained_variance;  // absent without a value network
  double mean_std = 0;                       // of continuous actions
  std::optional<ImitationReport> imitation;
  std::optional<double> clone_log_likelihood;
  std::optional<BcoReport> bco;  // at the end of a round
};

// InputError for settings that do not fit together, or not to the environment, in any run of this
// method.
void check_settings(const Settings& settings, const std::string& environment,
                    const std::string& method);

class Trainer {
 public:
  // Checks that task and demonstrations fit together (InputError) and builds everything; a cloned
  // start is fitted here. Several ranks train one policy if each has a Trainer of the same task;
  // building exchanges nothing.
  explicit Trainer(TrainingTask task, Communicator& communicator = no_other_ranks());

  // Collects a batch and learns from it. Not for bc, which is done once constructed.
  UpdateReport update();

  std::int64_t timesteps() const { return timesteps_; }
  bool finished() const {
    return !learns_by_interaction() || timesteps_ >= task_.settings.run.timesteps;
  }
  bool learns_by_interaction() const { return task_.method != "bc"; }
  const TrainingTask& task() const { return task_; }
  ThreadPool& pool() { return pool_; }
  Team team() const { return team_; }
  SavedPolicy policy() const;

  // Absent for trpo.
  const std::optional<DemonstrationsSummary>& demonstrations() const { return demonstrations_; }

  // How the policy was cloned, and how missing actions were inferred before that.
  const std::optional<RegressionReport>& cloning() const { return cloning_; }
  const std::optional<RegressionReport>& inverse_dynamics() const { return inverse_dynamics_; }

  // Everything that the next update depends on. Saving is for all ranks together.
  void archive(Archive& a);

  // For benchmarks: the collector before an update, and what the update collected and cost.
  Collector& collector() { return collector_; }
  const Batch& batch() const { return batch_; }
  const Stopwatch& stopwatch() const { return stopwatch_; }

 private:
  void check();
  void start();
  void learn(UpdateReport& report);
  void check_finite(const UpdateReport& report) const;

  TrainingTask task_;
  EnvironmentSpec spec_;
  ActionUnits units_;
  ThreadPool pool_;
  Team team_;
  std::optional<DemonstrationsSummary> demonstrations_;
  std::unique_ptr<DemoData> demos_;
  PolicyNetwork<float> network_;
  Vector<float> theta_;
  Normalizer normalizer_;
  bool normalizer_frozen_ = false;
  Collector collector_;
  Batch batch_;
  ValueFunction value_;
  AdvantageEstimator advantage_;
  Trpo trpo_;
  std::unique_ptr<AdversarialReward> reward_;
  CloningTargets targets_;
  std::unique_ptr<CloningTerm> cloning_term_;
  std::unique_ptr<BehaviorCloningFromObservation> bco_;  // of method bco, or while exploring
  std::optional<std::int64_t> exploring_rounds_;         // left; absent: the start does not explore
  std::optional<RegressionReport> cloning_, inverse_dynamics_;
  Vector<float> rewards_;
  Stopwatch stopwatch_;

  std::int64_t timesteps_ = 0, updates_ = 0, episodes_ = 0, diverged_ = 0, value_warmup_ = 0;
  std::vector<double> recent_returns_, recent_lengths_;  // of the last 100 episodes, a ring
};

}  // namespace agail
