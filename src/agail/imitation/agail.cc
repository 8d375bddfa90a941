#include "agail/imitation/agail.h"

#include <algorithm>
#include <numeric>

namespace agail {

namespace {

std::vector<Index> columns_for(const std::string& method, const DemoData& demos) {
  if (method == "gail") {
    if (demos.full_action.empty())
      throw InputError(
          "method gail learns from states with complete actions, but the demonstrations have none; "
          "use --method agail or state-gail");
    return demos.full_action;
  }
  std::vector<Index> all(static_cast<std::size_t>(demos.size()));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

}  // namespace

AdversarialReward::AdversarialReward(const std::string& method, const DemoData& demos,
                                     const ActionSpace& action, double missing_ratio,
                                     const Settings& settings, Team team, Index capacity,
                                     std::uint64_t seed)
    : demos_(demos),
      action_(action),
      settings_(settings),
      beta_(settings.reward.beta.value_or(1 - missing_ratio)),
      demo_columns_(columns_for(method, demos)),
      discriminator_(static_cast<int>(demos.states.rows()), action, method == "gail",
                     settings.discriminator, settings.policy.observation_clip, team, capacity,
                     seed),
      executed_(Matrix<float>::Zero(action.dim, capacity)),
      guide_rewards_(Vector<float>::Zero(capacity)) {
  // Everything missing: no guide is built, and what remains is state-GAIL to the bit.
  if (method == "agail" && beta_ > 0 && !demos.some_action.empty())
    guide_ =
        std::make_unique<Guide>(demos, action, settings.guide, settings.discriminator.minibatch,
                                settings.policy.observation_clip, team, seed);
}

// Algorithm 1 of the paper, for one batch of trajectories tau ~ pi:
ImitationReport AdversarialReward::update(const Batch& batch, const PolicyView& policy,
                                          std::uint32_t update, Vector<float>& rewards,
                                          Stopwatch& stopwatch) {
  ImitationReport report;
  const Index n = batch.size();
  for (Index j = 0; j < n; ++j)
    clip_action(action_, batch.actions.col(j).data(), executed_.col(j).data());
  const Discriminator::Samples visited{batch.observations, executed_, n};
  const Discriminator::Samples demonstrated{demos_.states, demos_.actions, demos_.size()};
  // The first batch it sees has another number than 0 after a start that explores.
  const bool learns = update % settings_.discriminator.every == 0 || !discriminator_.has_learned();

  stopwatch.start(Phase::kDiscriminator);
  // Sample states s_i ~ tau and s_E ~ demonstrations; update D by the gradient of log D(s_i) +
  // log(1 - D(s_E)).
  if (learns)
    report.discriminator = discriminator_.learn(visited, demonstrated, demo_columns_, update);
  // r = alpha r_D(s)
  discriminator_.rewards(visited, rewards);
  report.discriminator_reward = rewards.head(n).cast<double>().mean();
  rewards.head(n) *= static_cast<float>(settings_.reward.alpha);

  if (guide_ != nullptr) {
    stopwatch.start(Phase::kGuide);
    // Sample s_E with an available a_E, run a ~ pi(.|s_E); update Q by the gradient of log Q(a_E |
    // s_E, a).
    if (learns) {
      report.guide = guide_->learn(policy, settings_.discriminator.minibatches, update);
      guide_->diagnose(policy, batch.observations, n, update, *report.guide);
    }
    // r += beta r_Q(s, a)
    guide_->rewards(batch.observations, executed_, n, update, guide_rewards_);
    report.has_guide = true;
    report.guide_reward = guide_rewards_.head(n).cast<double>().mean();
    rewards.head(n) += static_cast<float>(beta_) * guide_rewards_.head(n);
  }
  stopwatch.start(Phase::kRest);

  // The constant part of the reward pays for living, or for dying; a share of it is taken out.
  if (settings_.reward.centring > 0) {
    running_count_ = std::min(running_count_ + 1, 20.0);
    running_mean_ += (rewards.head(n).cast<double>().mean() - running_mean_) / running_count_;
    rewards.head(n).array() -= static_cast<float>(settings_.reward.centring * running_mean_);
  }
  return report;
}

void AdversarialReward::archive(Archive& a) {
  a.scope("discriminator", [&](Archive& inner) { discriminator_.archive(inner); });
  if (guide_ != nullptr) a.scope("guide", [&](Archive& inner) { guide_->archive(inner); });
  a("running_mean", running_mean_);
  a("running_count", running_count_);
}

}  // namespace agail
