#include "agail/imitation/bco.h"

#include <algorithm>
#include <numeric>

namespace agail {

namespace {

Matrix<float> beside(const Matrix<float>& left, const Matrix<float>& right, Index columns) {
  Matrix<float> both(left.rows(), left.cols() + columns);
  both.leftCols(left.cols()) = left;
  both.rightCols(columns) = right.leftCols(columns);
  return both;
}

}  // namespace

BehaviorCloningFromObservation::BehaviorCloningFromObservation(
    const PolicyNetwork<float>& network, const Normalizer& normalizer, const DemoData& demos,
    const ActionSpace& action, const Settings& settings, ThreadPool& pool, std::uint64_t seed)
    : network_(network),
      normalizer_(normalizer),
      demos_(demos),
      action_(action),
      settings_(settings),
      pool_(pool),
      seed_(seed),
      inverse_dynamics_(static_cast<int>(demos.states.rows()), action, settings.inverse_dynamics,
                        settings.policy.observation_clip, seed),
      states_(Matrix<float>::Zero(demos.states.rows(), settings.bco.buffer)),
      next_states_(states_),
      actions_(Matrix<float>::Zero(action.dim, settings.bco.buffer)) {}

void BehaviorCloningFromObservation::keep(const Batch& batch) {
  for (Index j = 0; j < batch.size(); ++j) {
    const Index slot = kept_++ % states_.cols();
    states_.col(slot) = batch.observations.col(j);
    if (batch.has_final_observation(j))
      next_states_.col(slot) = batch.final_observations.col(j);
    else
      next_states_.col(slot) = batch.observations.col(j + 1);
    // What was executed: beyond its bounds an action has no effect of its own.
    clip_action(action_, batch.actions.col(j).data(), actions_.col(slot).data());
  }
}

// Learns from all own transitions and the demonstrated ones with an available action; fills in the
// missing ones.
RegressionReport BehaviorCloningFromObservation::learn_inverse_dynamics(std::uint32_t round,
                                                                        CloningTargets& targets) {
  const Index own = std::min<Index>(kept_, states_.cols());
  const Matrix<float> states = beside(demos_.states, states_, own);
  const Matrix<float> next_states = beside(demos_.next_states(), next_states_, own);
  const Matrix<float> actions = beside(demos_.actions, actions_, own);
  const Matrix<float> available =
      beside(demos_.available, Matrix<float>::Ones(action_.dim, own), own);
  const Transitions data{states, next_states, actions, available};
  std::vector<Index> columns = demos_.some_action;
  for (Index j = 0; j < own; ++j) columns.push_back(demos_.size() + j);
  const RegressionReport report =
      inverse_dynamics_.learn(data, std::move(columns), settings_.bco.epochs, round, pool_);
  targets.actions = demos_.actions;
  targets.available = demos_.available;
  inverse_dynamics_.infer(data, demos_.size(), Vector<float>::Ones(action_.dim), pool_,
                          targets.actions, targets.available);
  return report;
}

std::optional<BcoReport> BehaviorCloningFromObservation::update(const Batch& batch,
                                                                std::uint32_t update,
                                                                Vector<float>& theta,
                                                                CloningTargets& targets) {
  keep(batch);
  const auto every = static_cast<std::uint32_t>(settings_.bco.every);
  if ((update + 1) % every != 0) return std::nullopt;
  const std::uint32_t round = (update + 1) / every;
  targets.columns.resize(static_cast<std::size_t>(demos_.size()));
  std::iota(targets.columns.begin(), targets.columns.end(), Index{0});
  BcoReport report;
  report.inverse_dynamics = learn_inverse_dynamics(round, targets);
  BcSettings cloning = settings_.bc;
  cloning.epochs = settings_.bco.epochs;
  report.cloning = clone_policy(network_, normalizer_, demos_, targets, cloning, false, pool_,
                                seed_, theta, round);
  theta.tail(network_.distribution.log_stds())
      .setConstant(static_cast<float>(settings_.start.log_std));
  return report;
}

void BehaviorCloningFromObservation::archive(Archive& a) {
  a.scope("inverse_dynamics", [&](Archive& inner) { inverse_dynamics_.archive(inner); });
  a("states", all_of(states_));
  a("next_states", all_of(next_states_));
  a("actions", all_of(actions_));
  a("kept", kept_);
}

}  // namespace agail
