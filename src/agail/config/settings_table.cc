// The one description of every setting: name and field, allowed values, unit, help.
#include "agail/config/setting.h"

namespace agail {
namespace {

// The name is the field's path, so the two cannot differ.
#define AGAIL_SETTING(path) \
#path, [](Settings & s) -> auto& { return s.path; }

Allowed any() { return {}; }
Allowed at_least(double low) { return {.low = low}; }
// Of something that takes memory or time each; also the most units of a layer in a policy file.
Allowed count() { return {.low = 1, .high = 1 << 20}; }
Allowed steps() { return {.low = 1, .high = 1 << 30}; }
Allowed above(double low) { return {.low = low, .above_low = true}; }
Allowed between(double low, double high) { return {.low = low, .high = high}; }
Allowed above_up_to(double low, double high) {
  return {.low = low, .high = high, .above_low = true};
}
Allowed from_to_below(double low, double high) {
  return {.low = low, .high = high, .below_high = true};
}
Allowed one_of(std::vector<std::string> names) { return {.choices = std::move(names)}; }

}  // namespace

std::span<const Setting> settings_table() {
  // clang-format off
  static const std::vector<Setting> table = {
    {AGAIL_SETTING(run.timesteps), at_least(1), "environment steps", "training ends after the first update at or past this many steps"},
    {AGAIL_SETTING(run.batch_steps), steps(), "environment steps", "steps collected for one policy update, all lanes together"},
    {AGAIL_SETTING(run.lanes), count(), "", "environments that collect a batch side by side"},
    {AGAIL_SETTING(run.checkpoint_every), at_least(1), "updates", "distance of checkpoints"},
    {AGAIL_SETTING(run.evaluate_every), at_least(0), "updates", "distance of evaluations; 0 for none"},
    {AGAIL_SETTING(run.evaluation_episodes), count(), "episodes", "episodes of one evaluation"},

    {AGAIL_SETTING(policy.hidden), count(), "units", "hidden layers of the policy network (tanh)"},
    {AGAIL_SETTING(policy.initial_log_std), between(-20, 5), "", "log standard deviation of continuous actions at the start"},
    {AGAIL_SETTING(policy.normalize_observations), any(), "", "subtract the running mean of the observations and divide by their deviation"},
    {AGAIL_SETTING(policy.observation_clip), above(0), "standard deviations", "normalised observations are clipped to this"},
    {AGAIL_SETTING(policy.freeze_normalizer), any(), "", "take mean and deviation from the demonstrated states and keep them; not for trpo"},

    {AGAIL_SETTING(trpo.gamma), above_up_to(0, 1), "", "discount factor"},
    {AGAIL_SETTING(trpo.lambda), between(0, 1), "", "weight of longer returns in generalised advantage estimation"},
    {AGAIL_SETTING(trpo.max_kl), above(0), "nats", "largest mean KL divergence of one policy step"},
    {AGAIL_SETTING(trpo.cg_iterations), count(), "", "conjugate gradient iterations"},
    {AGAIL_SETTING(trpo.cg_damping), at_least(0), "", "added to the diagonal of the Fisher matrix"},
    {AGAIL_SETTING(trpo.fisher_stride), count(), "samples", "the Fisher matrix uses every n-th sample of the batch"},
    {AGAIL_SETTING(trpo.line_search_halvings), count(), "", "candidates of the line search: the step, then each half the one before"},
    {AGAIL_SETTING(trpo.entropy_weight), at_least(0), "", "weight of the policy's causal entropy in its objective"},

    {AGAIL_SETTING(value.hidden), count(), "units", "hidden layers of the value network (tanh)"},
    {AGAIL_SETTING(value.epochs), count(), "", "passes over the batch in one update"},
    {AGAIL_SETTING(value.learning_rate), above(0), "", "step size of Adam"},
    {AGAIL_SETTING(value.minibatch), count(), "samples", "samples of one Adam step"},
    {AGAIL_SETTING(value.normalize_targets), any(), "", "scale the returns by their running mean and deviation"},

    {AGAIL_SETTING(discriminator.features), at_least(0), "", "indices of the observation that the discriminator sees; [] for all"},
    {AGAIL_SETTING(discriminator.hidden), count(), "units", "hidden layers of the discriminator (tanh)"},
    {AGAIL_SETTING(discriminator.learning_rate), above(0), "", "step size of Adam"},
    {AGAIL_SETTING(discriminator.entropy_weight), at_least(0), "", "weight of the entropy of its output, which keeps it from certainty"},
    {AGAIL_SETTING(discriminator.gradient_penalty), at_least(0), "", "weight of (|gradient| - 1)^2 between policy and demonstration states"},
    {AGAIL_SETTING(discriminator.minibatches), count(), "", "Adam steps in one update, also the guide's"},
    {AGAIL_SETTING(discriminator.minibatch), count(), "samples", "samples of one Adam step, from policy and demonstrations each, also the guide's"},
    {AGAIL_SETTING(discriminator.every), at_least(1), "policy batches", "discriminator and guide learn once in this many batches"},
    {AGAIL_SETTING(discriminator.reward), one_of({"softplus", "log-odds", "probability", "log-probability"}), "", "reward for an output d with P = sigmoid(d): -log(1 - P), d, P or log P"},

    {AGAIL_SETTING(guide.target), one_of({"random", "nearest", "own"}), "", "action that the guide is asked about: a random demonstrated one, that of the nearest demonstrated state, or the policy's own"},
    {AGAIL_SETTING(guide.reward), one_of({"likelihood", "log-likelihood"}), "", "what of the guide's answer is the reward"},
    {AGAIL_SETTING(guide.hidden), count(), "units", "width of the guide's layers: for s, for a, and above both (leaky ReLU)"},
    {AGAIL_SETTING(guide.learning_rate), above(0), "", "step size of Adam"},

    {AGAIL_SETTING(reward.alpha), at_least(0), "", "weight of the discriminator's reward"},
    {AGAIL_SETTING(reward.beta), at_least(0), "", "weight of the guide's reward; \"auto\" is 1 - missing ratio"},
    {AGAIL_SETTING(reward.centring), between(0, 1), "", "share of the running mean reward that is subtracted"},
    {AGAIL_SETTING(reward.terminal_value), any(), "", "value of the state after a termination, when imitating"},

    {AGAIL_SETTING(start.method), one_of({"random", "clone", "clone-inferred"}), "", "how the policy starts: with random weights, cloned from the available actions, or from available and inferred ones"},
    {AGAIL_SETTING(start.log_std), between(-20, 5), "", "log standard deviation of continuous actions, if the policy starts cloned"},
    {AGAIL_SETTING(start.value_warmup), at_least(0), "batches", "batches at the start in which the policy does not move yet, if it starts cloned; everything else learns"},

    {AGAIL_SETTING(clone.weight), at_least(0), "", "weight of the cloning term in the policy's objective at the start"},
    {AGAIL_SETTING(clone.decay), between(0, 1), "an update", "factor of the cloning term's weight"},
    {AGAIL_SETTING(clone.minibatch), count(), "samples", "demonstrated states drawn for the cloning term of one update"},

    {AGAIL_SETTING(bc.epochs), count(), "", "passes over the demonstrations, of which the one with the least held-out loss is kept"},
    {AGAIL_SETTING(bc.learning_rate), above(0), "", "step size of Adam"},
    {AGAIL_SETTING(bc.minibatch), count(), "samples", "samples of one Adam step"},
    {AGAIL_SETTING(bc.validation_share), from_to_below(0, 1), "", "share of the demonstrated steps that is held out to choose the epoch"},

    {AGAIL_SETTING(inverse_dynamics.hidden), count(), "units", "hidden layers of the inverse dynamics network (tanh)"},
    {AGAIL_SETTING(inverse_dynamics.epochs), count(), "", "passes over the data"},
    {AGAIL_SETTING(inverse_dynamics.learning_rate), above(0), "", "step size of Adam"},

    {AGAIL_SETTING(bco.every), count(), "policy batches", "batches collected before inverse dynamics and the policy are fitted again"},
    {AGAIL_SETTING(bco.buffer), steps(), "transitions", "latest own transitions that inverse dynamics learns from"},
    {AGAIL_SETTING(bco.epochs), count(), "", "passes over the data in one fit, of inverse dynamics and of the policy each"},
  };
  // clang-format on
  return table;
}

}  // namespace agail
