#include "agail/train/trainer.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "agail/base/memory_limit.h"

namespace agail {

namespace {

constexpr std::size_t kRecentEpisodes = 100;
// Of a start that explores. Measured on Hopper-v5 and Walker2d-v5: with fewer rounds or passes the
// inferred actions are so poor that the adversarial part starts from next to nothing.
constexpr std::int64_t kExploringRounds = 6, kExploringEpochs = 60;

// Bytes that fit_actions() takes for n steps: inputs, targets, and the outputs of all layers for
// the held-out ones.
std::uint64_t memory_to_fit(Index n, Index inputs, const Sizes& hidden, const ActionSpace& action,
                            double validation_share) {
  const auto step = static_cast<double>(inputs + 1 + Index{2} * action.dim);
  const double layers = static_cast<double>(action.encoded_dim()) +
                        std::accumulate(hidden.begin(), hidden.end(), 0.0);
  return static_cast<std::uint64_t>(sizeof(float) * static_cast<double>(n) *
                                    (step + validation_share * (step + layers)));
}

}  // namespace

void check_settings(const Settings& settings, const std::string& environment,
                    const std::string& method) {
  const RunSettings& run = settings.run;
  if (run.batch_steps % run.lanes != 0)
    throw InputError("settings run.batch_steps = " + std::to_string(run.batch_steps) +
                     " and run.lanes = " + std::to_string(run.lanes) +
                     " do not fit: every lane takes batch_steps / lanes steps; choose a multiple");
  if (method == "trpo" || method == "bc" || method == "bco") return;
  check_features(settings.discriminator.features, environment_spec(environment).observation_dim);
}

Trainer::Trainer(TrainingTask task, Communicator& communicator)
    : task_(std::move(task)),
      spec_(environment_spec(task_.environment)),
      units_(spec_.action),
      pool_(task_.threads),
      team_(pool_, communicator),
      network_(spec_.observation_dim, task_.settings.policy.hidden, spec_.action),
      theta_(Vector<float>::Zero(network_.parameters())),
      normalizer_(spec_.observation_dim, task_.settings.policy.normalize_observations,
                  task_.settings.policy.observation_clip),
      collector_(task_.environment, task_.settings.run.lanes, task_.seed, team_),
      batch_(spec_.observation_dim, spec_.action.dim, task_.settings.run.lanes,
             task_.settings.run.batch_steps / task_.settings.run.lanes),
      value_(spec_.observation_dim, task_.settings.value, team_, batch_.size(), task_.seed),
      advantage_(spec_.observation_dim, batch_.size()),
      trpo_(network_, team_, task_.settings.trpo, batch_.size()),
      rewards_(Vector<float>::Zero(batch_.size())) {
  check();
  recent_returns_.reserve(kRecentEpisodes);
  recent_lengths_.reserve(kRecentEpisodes);
  RandomStream random(task_.seed, Purpose::kInitialise, 0);
  network_.initialise(theta_.data(), random, task_.settings.policy.initial_log_std);
  start();
}

void Trainer::check() {
  check_settings(task_.settings, task_.environment, task_.method);
  if (task_.method == "trpo") {
    task_.demonstrations.reset();
    return;
  }
  if (!task_.demonstrations)
    throw InputError("method " + task_.method +
                     " learns from demonstrations; give them with --demos FILE");
  Demonstrations& demos = *task_.demonstrations;
  if (demos.action.dim == 0) {  // the file has no actions and does not say what they would be
    demos.action = spec_.action;
    for (DemoEpisode& episode : demos.episodes) {
      const Index steps = episode.observations.rows() - 1;
      episode.actions = RowMatrix<double>::Zero(steps, spec_.action.dim);
      episode.available = RowMatrix<std::uint8_t>::Zero(steps, spec_.action.dim);
    }
  }
  const bool same_kind = demos.action.discrete == spec_.action.discrete &&
                         demos.action.dim == spec_.action.dim && demos.action.n <= spec_.action.n;
  if (demos.observation_dim != spec_.observation_dim || !same_kind)
    throw InputError("the demonstrations have " +
                     sizes_in_words(demos.observation_dim, demos.action) + ", " + spec_.id +
                     " has " + sizes_in_words(spec_.observation_dim, spec_.action) +
                     "; give demonstrations of this environment");
  if (demos.transitions() == 0)
    throw InputError("the demonstrations have no steps; record at least one episode");
  demos.action = spec_.action;
}

void Trainer::start() {
  const Settings& settings = task_.settings;
  if (task_.method == "trpo") return;
  require_memory(DemoData::memory(*task_.demonstrations), "training on these demonstrations");
  demonstrations_ = summarise(*task_.demonstrations);
  demos_ = std::make_unique<DemoData>(*task_.demonstrations);
  task_.demonstrations.reset();  // with many of them, half of the memory
  const double missing = demonstrations_->missing_ratio;
  if (task_.method == "bco") {
    normalizer_frozen_ = true;
    normalizer_.update(pool_, demos_->states);
    bco_ = std::make_unique<BehaviorCloningFromObservation>(
        network_, normalizer_, *demos_, units_.space(), settings, pool_, task_.seed);
    return;
  }
  const bool adversarial = task_.method != "bc";
  if (adversarial)
    reward_ = std::make_unique<AdversarialReward>(task_.method, *demos_, units_.space(), missing,
                                                  settings, team_, batch_.size(), task_.seed);

  // state-gail is the method that never looks at an action.
  const bool has_actions = !demos_->some_action.empty() && task_.method != "state-gail";
  if (!adversarial && !has_actions)
    throw InputError(
        "method bc learns from actions, but the demonstrations have none; use --method bco, agail "
        "or state-gail");
  const bool clones = !adversarial || (has_actions && settings.start.method != "random");
  normalizer_frozen_ = clones || settings.policy.freeze_normalizer;
  if (normalizer_frozen_) normalizer_.update(pool_, demos_->states);
  if (!has_actions) return;

  const bool infers = adversarial && settings.start.method == "clone-inferred" && missing > 0;
  const Index n = demos_->size(), inputs = spec_.observation_dim;
  if (infers)
    require_memory(memory_to_fit(n, 2 * inputs, settings.inverse_dynamics.hidden, spec_.action,
                                 RegressionSettings().validation_share) +
                       static_cast<std::size_t>(demos_->states.size()) * sizeof(float),
                   "inferring the missing actions of these demonstrations");
  if (clones)
    require_memory(memory_to_fit(n, inputs, settings.policy.hidden, spec_.action,
                                 settings.bc.validation_share),
                   "cloning these demonstrations");
  targets_ = {demos_->actions, demos_->available, demos_->some_action};
  if (infers) {
    inverse_dynamics_ = infer_missing_actions(*demos_, units_.space(), settings.inverse_dynamics,
                                              settings.policy.observation_clip, pool_, task_.seed,
                                              targets_.actions, targets_.available);
    targets_.columns.resize(static_cast<std::size_t>(demos_->size()));
    std::iota(targets_.columns.begin(), targets_.columns.end(), Index{0});
    // Of a dimension that no demonstration tells only own transitions can: the start goes on with
    // rounds of bco, which replace the targets.
    if (targets_.available.minCoeff() == 0) {
      exploring_rounds_ = kExploringRounds;
      Settings exploring = settings;
      exploring.bco.epochs = kExploringEpochs;
      bco_ = std::make_unique<BehaviorCloningFromObservation>(
          network_, normalizer_, *demos_, units_.space(), exploring, pool_, task_.seed);
    }
  }
  if (clones) {
    cloning_ = clone_policy(network_, normalizer_, *demos_, targets_, settings.bc, !adversarial,
                            pool_, task_.seed, theta_);
    if (adversarial) {
      theta_.tail(network_.distribution.log_stds())
          .setConstant(static_cast<float>(settings.start.log_std));
      value_warmup_ = settings.start.value_warmup;
    }
  }
  if (adversarial && settings.clone.weight > 0)
    cloning_term_ = std::make_unique<CloningTerm>(network_, normalizer_, *demos_, targets_,
                                                  settings.clone, pool_, task_.seed);
}

// From the rewards of the batch: one step of the policy, and the value network's fit.
void Trainer::learn(UpdateReport& report) {
  const Settings& settings = task_.settings;
  const Index n = batch_.size();
  const auto number = static_cast<std::uint32_t>(updates_);

  // Rewards: the environment's, or those of discriminator and guide, which learn first.
  double terminal_value = 0;
  if (reward_) {
    report.imitation =
        reward_->update(batch_, {network_, theta_, normalizer_}, number, rewards_, stopwatch_);
    terminal_value = settings.reward.terminal_value;
  } else {
    rewards_ = batch_.rewards;
  }

  stopwatch_.start(Phase::kValue);
  advantage_.estimate(batch_, rewards_, value_, normalizer_, settings.trpo, terminal_value);
  report.explained_variance = advantage_.explained_variance(n);
  advantage_.normalize(n);
  stopwatch_.start(Phase::kRest);

  if (value_warmup_ > 0)
    --value_warmup_;
  else
    report.trpo = trpo_.update(theta_, batch_.inputs, batch_.actions, advantage_.advantages(), n,
                               cloning_term_.get(), stopwatch_);
  if (report.trpo && cloning_term_) report.clone_log_likelihood = cloning_term_->log_likelihood();

  stopwatch_.start(Phase::kValue);
  value_.fit(batch_.inputs, advantage_.targets(), n, number);
  stopwatch_.start(Phase::kRest);
  check_finite(report);
}

// A NaN in one network reaches the policy's gradient, and from then on no step is taken.
void Trainer::check_finite(const UpdateReport& report) const {
  const auto fail = [&](const std::string& what, const std::string& setting) {
    throw InputError("training diverged after " + std::to_string(timesteps_) + " steps: " + what +
                     " is not finite; lower " + setting);
  };
  if (!rewards_.allFinite())
    fail("the reward",
         reward_ ? "discriminator.learning_rate, guide.learning_rate or the weights of the rewards"
                 : "the scale of the rewards");
  if (!value_.finite()) fail("the value network", "value.learning_rate");
  if (report.trpo && !std::isfinite(report.trpo->gradient_norm))
    fail("the policy's gradient", "value.learning_rate or the scale of the rewards");
}

UpdateReport Trainer::update() {
  const Index n = batch_.size();
  const auto number = static_cast<std::uint32_t>(updates_);
  UpdateReport report;
  stopwatch_.begin_update();

  // Roll out the policy.
  collector_.collect(network_, theta_, normalizer_, batch_, stopwatch_);
  timesteps_ += n;
  for (const FinishedEpisode& episode : batch_.finished) {
    const auto slot = static_cast<std::size_t>(episodes_++) % kRecentEpisodes;
    recent_returns_.resize(std::max(recent_returns_.size(), slot + 1));
    recent_lengths_.resize(recent_returns_.size());
    recent_returns_[slot] = episode.episode_return;
    recent_lengths_[slot] = episode.length;
  }
  diverged_ += batch_.diverged;

  if (bco_)
    report.bco = bco_->update(batch_, number, theta_, targets_);
  else
    learn(report);
  if (exploring_rounds_ && report.bco && --*exploring_rounds_ == 0) bco_.reset();

  if (!normalizer_frozen_) normalizer_.update(pool_, batch_.observations);
  ++updates_;

  const auto mean = [](const std::vector<double>& v) {
    return v.empty() ? std::numeric_limits<double>::quiet_NaN()
                     : std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  };
  report.update = updates_;
  report.timesteps = timesteps_;
  report.episode_return = mean(recent_returns_);
  report.episode_length = mean(recent_lengths_);
  report.episodes = episodes_;
  report.diverged = diverged_;
  if (!spec_.action.discrete)
    report.mean_std =
        theta_.tail(network_.distribution.log_stds()).cast<double>().array().exp().mean();
  return report;
}

SavedPolicy Trainer::policy() const {
  PolicyInfo info{spec_.id, task_.method, timesteps_, task_.settings_toml, {}, spec_.layout};
  if (demonstrations_) info.demonstrations_mean_return = demonstrations_->mean_return;
  return {std::move(info),
          spec_.observation_dim,
          spec_.action,
          task_.settings.policy.hidden,
          normalizer_,
          normalizer_.standard_deviation(),
          units_.in_environment(network_, theta_)};
}

void Trainer::archive(Archive& a) {
  a("theta", all_of(theta_));
  a("timesteps", timesteps_);
  a("updates", updates_);
  a("episodes", episodes_);
  a("diverged", diverged_);
  a("value_warmup", value_warmup_);
  a.resizable("recent_returns", recent_returns_);
  a.resizable("recent_lengths", recent_lengths_);
  a.scope("normalizer", [&](Archive& inner) { normalizer_.archive(inner); });
  a.scope("value", [&](Archive& inner) { value_.archive(inner); });
  a.scope("lane", [&](Archive& inner) { collector_.archive(inner); });
  if (reward_) a.scope("reward", [&](Archive& inner) { reward_->archive(inner); });
  if (exploring_rounds_) {
    a("exploring_rounds", *exploring_rounds_);
    a("target_actions", all_of(targets_.actions));
    a("target_available", all_of(targets_.available));
    if (exploring_rounds_ == 0) bco_.reset();
  }
  if (bco_) a.scope("bco", [&](Archive& inner) { bco_->archive(inner); });
  if (cloning_term_)
    a.scope("cloning_term", [&](Archive& inner) { cloning_term_->archive(inner); });
}

}  // namespace agail
