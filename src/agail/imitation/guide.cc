#include "agail/imitation/guide.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "agail/base/random.h"
#include "agail/imitation/nearest_state.h"
#include "agail/rl/rollout.h"

namespace agail {

namespace {

constexpr Index kHoldOutEvery = 10;  // one available action in ten is kept to measure the guide
constexpr Index kHeldOutAtMost = 256;
constexpr Index kDiagnosticStates = 64;
constexpr Index kActionsAState = 8;
// A Gaussian on actions that a deterministic demonstrator gave would narrow without end, and its
// likelihood with it.
constexpr float kLogStdFloor = -3;

}  // namespace

template <class S>
GuideNetwork<S>::GuideNetwork(Index observation_dim, const ActionSpace& action, Index hidden,
                              bool sees_action)
    : distribution(action),
      mlp(sees_action
              ? std::vector<int>{static_cast<int>(observation_dim) + action.encoded_dim(),
                                 2 * static_cast<int>(hidden), static_cast<int>(hidden),
                                 action.encoded_dim()}
              : std::vector<int>{static_cast<int>(observation_dim), static_cast<int>(hidden),
                                 static_cast<int>(hidden), action.encoded_dim()},
          Activation::kLeakyRelu),
      observation_dim_(observation_dim),
      sees_action_(sees_action) {}

template <class S>
void GuideNetwork<S>::separate(S* first_layer) const {
  if (!sees_action_) return;
  const Index units = mlp.sizes()[1];
  Eigen::Map<Matrix<S>> w(first_layer, units, mlp.inputs());
  w.block(units / 2, 0, units / 2, observation_dim_).setZero();
  w.block(0, observation_dim_, units / 2, mlp.inputs() - observation_dim_).setZero();
}

template <class S>
void GuideNetwork<S>::initialise(S* theta, RandomStream& random) const {
  mlp.initialise(theta, random, 0.1);
  separate(theta);
  std::fill_n(theta + mlp.parameters(), distribution.log_stds(), S(0));
}

template <class S>
double GuideNetwork<S>::loss(ThreadPool& pool, ChunkSums<S>& sums, std::vector<Scratch<S>>& scratch,
                             const Vector<S>& theta, const Matrix<S>& x, const Matrix<S>& targets,
                             const Matrix<S>& available, Index n, Vector<S>& gradient) const {
  const Index p = parameters();
  // The loss itself travels as one more number behind the gradient.
  const auto total = sums.sum(pool, n, [&](Index, int w, Index first, Index count, S* out) {
    Scratch<S>& space = scratch[static_cast<std::size_t>(w)];
    const auto input = x.block(0, first, mlp.inputs() + 1, count);
    mlp.forward(theta.data(), input, space.tape, 0);
    const auto output = mlp.output(space.tape, 0, count);
    const auto target = targets.block(0, first, targets.rows(), count);
    const ConstView<S> mask = available.block(0, first, available.rows(), count);
    Eigen::Matrix<S, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kChunk> weight(count),
        log_q(count);  // on the stack
    distribution.log_prob(output, log_std(theta.data()), target, &mask, log_q);
    weight.setConstant(S(-1) / static_cast<S>(n));
    out[p] = log_q.sum() * weight[0];
    View<S> adjoint = space.d.block(0, 0, mlp.outputs(), count);
    S* d_log_std = out + mlp.parameters();
    std::fill_n(d_log_std, distribution.log_stds(), S(0));
    distribution.score(output, log_std(theta.data()), target, &mask, weight, adjoint, d_log_std);
    mlp.backward(theta.data(), input, space.tape, 0, adjoint, out, space);
    separate(out);
  });
  gradient = total.head(p);
  return static_cast<double>(total[p]);
}

template class GuideNetwork<float>;
template class GuideNetwork<double>;

Guide::Guide(const DemoData& demos, const ActionSpace& action, const GuideSettings& settings,
             Index minibatch, double clip, Team team, std::uint64_t seed)
    : demos_(demos),
      action_(action),
      settings_(settings),
      team_(team),
      seed_(seed),
      minibatch_(minibatch),
      network_(demos.states.rows(), action, settings.hidden, settings.target != "own"),
      normalizer_(demos.states.rows(), true, clip),
      theta_(Vector<float>::Zero(network_.parameters())),
      adam_(network_.parameters()),
      known_dimensions_(static_cast<std::size_t>(action.dim)),
      sums_(network_.parameters() + 1, minibatch),
      tape_(network_.mlp.make_tape(std::max(kHeldOutAtMost, kDiagnosticStates * kActionsAState))),
      x_(Matrix<float>::Zero(padded(network_.mlp.inputs() + 1), minibatch)),
      targets_(Matrix<float>::Zero(action.dim, minibatch)),
      available_(targets_),
      diagnostic_x_(Matrix<float>::Zero(x_.rows(), tape_.outputs.back().cols())),
      gradient_(Vector<float>::Zero(network_.parameters())),
      sampled_(static_cast<std::size_t>(action.dim)),
      executed_(sampled_),
      drawn_(static_cast<std::size_t>(minibatch)),
      fresh_actions_(Matrix<float>::Zero(action.dim, kDiagnosticStates * kActionsAState)) {
  AGAIL_CHECK(!demos.some_action.empty());
  RandomStream random(seed, Purpose::kInitialise, 3);
  network_.initialise(theta_.data(), random);
  for (int i = 0; i < team.pool().threads(); ++i) {
    scratch_.push_back(network_.mlp.make_scratch());
    chunk_x_.emplace_back(Matrix<float>::Zero(x_.rows(), kChunk));
  }
  normalizer_.update(team.pool(), demos.states);

  std::vector<Index> columns = demos.some_action;
  RandomStream order(seed, Purpose::kHoldout, 3);
  shuffle(columns, order);
  const auto held = static_cast<std::ptrdiff_t>(std::min<std::size_t>(
      columns.size() / kHoldOutEvery, static_cast<std::size_t>(kHeldOutAtMost)));
  held_out_.assign(columns.begin(), columns.begin() + held);
  training_.assign(columns.begin() + held, columns.end());
  for (Index i = 0; i < action.dim; ++i)
    known_dimensions_[static_cast<std::size_t>(i)] = demos.available.row(i).maxCoeff();
  if (settings.target == "nearest")
    nearest_ = std::make_unique<NearestState>(demos, training_, normalizer_);
}

Guide::~Guide() = default;

void Guide::show_policy(const PolicyView& policy, const float* state, Index slot) {
  if (policy_input_.size() == 0) {
    const Index slots = std::max({minibatch_, kHeldOutAtMost, kDiagnosticStates});
    policy_input_.setZero(padded(policy.network.mlp.inputs() + 1), slots);
    policy_tape_ = policy.network.mlp.make_tape(slots);
  }
  policy.normalizer.apply(state, policy_input_.col(slot).data());
}

void Guide::run_policy(const PolicyView& policy, Index slots) {
  const Mlp<float>& mlp = policy.network.mlp;
  for_each_chunk(team_.pool(), slots, [&](int, Index first, Index count) {
    mlp.forward(policy.theta.data(), policy_input_.block(0, first, mlp.inputs() + 1, count),
                policy_tape_, first);
  });
}

void Guide::act(const PolicyView& policy, Index slot, RandomStream& random, float* executed) {
  policy.network.distribution.sample(policy_tape_.outputs.back().col(slot).data(),
                                     policy.network.log_std(policy.theta.data()), random,
                                     sampled_.data());
  clip_action(action_, sampled_.data(), executed);
}

void Guide::build_input(const float* state, const float* action, float* x) const {
  normalizer_.apply(state, x);
  if (sees_action()) encode_action(action_, action, x + normalizer_.size());
  x[network_.mlp.inputs()] = 1;
}

GuideReport Guide::learn(const PolicyView& policy, Index minibatches, std::uint32_t update) {
  GuideReport report;
  RandomStream random(seed_, Purpose::kGuide, 0, update);
  for (Index step = 0; step < minibatches; ++step) {
    for (Index j = 0; j < minibatch_; ++j) {
      const Index column = training_[random.below(static_cast<std::uint32_t>(training_.size()))];
      drawn_[static_cast<std::size_t>(j)] = column;
      if (sees_action()) show_policy(policy, demos_.states.col(column).data(), j);
    }
    if (sees_action()) run_policy(policy, minibatch_);
    for (Index j = 0; j < minibatch_; ++j) {
      const Index column = drawn_[static_cast<std::size_t>(j)];
      if (sees_action()) act(policy, j, random, executed_.data());
      build_input(demos_.states.col(column).data(), executed_.data(), x_.col(j).data());
      targets_.col(j) = demos_.actions.col(column);
      available_.col(j) = demos_.available.col(column);
    }
    const double loss = network_.loss(team_.pool(), sums_, scratch_, theta_, x_, targets_,
                                      available_, minibatch_, gradient_);
    adam_.descend(team_.pool(), theta_, gradient_, settings_.learning_rate);
    auto log_std = theta_.tail(network_.distribution.log_stds());
    log_std = log_std.cwiseMax(kLogStdFloor);
    report.loss += loss / static_cast<double>(minibatches);
  }
  return report;
}

float Guide::reward(const float* output, const float* target, const float* available) const {
  const bool likelihood = settings_.reward == "likelihood";
  const Index outputs = network_.mlp.outputs();
  if (action_.discrete) {
    const Eigen::Map<const Eigen::ArrayXf> logits(output, outputs);
    const float largest = logits.maxCoeff();
    const float log_p =
        logits[static_cast<Index>(target[0])] - largest - std::log((logits - largest).exp().sum());
    return likelihood ? std::exp(log_p) : log_p;
  }
  // Density over its peak, exp(-sum z^2 / 2), or the log-density.
  float sum = 0;
  const float* log_std = network_.log_std(theta_.data());
  for (Index i = 0; i < outputs; ++i) {
    if (available[i] == 0) continue;
    const float z = (target[i] - output[i]) * std::exp(-log_std[i]);
    sum -= 0.5F * z * z + (likelihood ? 0.0F : log_std[i] + 0.9189385F);  // log(2 pi) / 2
  }
  return likelihood ? std::exp(sum) : sum;
}

Index Guide::target_column(const float* state, RandomStream& random) const {
  if (nearest_) return nearest_->find(state);
  return training_[random.below(static_cast<std::uint32_t>(training_.size()))];
}

void Guide::rewards(const Matrix<float>& states, const Matrix<float>& actions, Index n,
                    std::uint32_t update, Vector<float>& rewards) {
  for_each_chunk(team_, n, [&](int w, Index first, Index count) {
    Tape<float>& tape = scratch_[static_cast<std::size_t>(w)].tape;
    Matrix<float>& x = chunk_x_[static_cast<std::size_t>(w)];
    for (Index j = 0; j < count; ++j)
      build_input(states.col(first + j).data(), actions.col(first + j).data(), x.col(j).data());
    network_.mlp.forward(theta_.data(), x.block(0, 0, network_.mlp.inputs() + 1, count), tape, 0);
    for (Index j = first; j < first + count; ++j) {
      const float* output = tape.outputs.back().col(j - first).data();
      if (sees_action()) {
        RandomStream random(seed_, Purpose::kGuideReward, 0, update, static_cast<std::uint32_t>(j));
        const Index column = target_column(states.col(j).data(), random);
        rewards[j] =
            reward(output, demos_.actions.col(column).data(), demos_.available.col(column).data());
      } else {
        rewards[j] = reward(output, actions.col(j).data(), known_dimensions_.data());
      }
    }
  });
  gather_chunks(team_, n, rewards);
}

void Guide::diagnose(const PolicyView& policy, const Matrix<float>& states, Index n,
                     std::uint32_t update, GuideReport& report) {
  RandomStream random(seed_, Purpose::kDiagnostics, 0, update);
  report.held_out_log_likelihood = held_out_log_likelihood(policy, random);
  report.action_variance_share = action_variance_share(policy, states, n, random);
}

void Guide::run_guide(Index columns) {
  for_each_chunk(team_.pool(), columns, [&](int, Index first, Index count) {
    network_.mlp.forward(theta_.data(),
                         diagnostic_x_.block(0, first, network_.mlp.inputs() + 1, count), tape_,
                         first);
  });
}

// E log Q on held-out available actions.
double Guide::held_out_log_likelihood(const PolicyView& policy, RandomStream& random) {
  const auto held = static_cast<Index>(held_out_.size());
  if (held == 0) return std::numeric_limits<double>::quiet_NaN();
  const auto column = [&](Index j) { return held_out_[static_cast<std::size_t>(j)]; };
  if (sees_action()) {
    for (Index j = 0; j < held; ++j) show_policy(policy, demos_.states.col(column(j)).data(), j);
    run_policy(policy, held);
  }
  for (Index j = 0; j < held; ++j) {
    if (sees_action()) act(policy, j, random, executed_.data());
    build_input(demos_.states.col(column(j)).data(), executed_.data(), diagnostic_x_.col(j).data());
  }
  run_guide(held);
  double sum = 0;
  for (Index j = 0; j < held; ++j) {
    const ConstView<float> mask = demos_.available.middleCols(column(j), 1);
    Eigen::Matrix<float, 1, 1> log_q;
    network_.distribution.log_prob(tape_.outputs.back().block(0, j, network_.mlp.outputs(), 1),
                                   network_.log_std(theta_.data()),
                                   demos_.actions.middleCols(column(j), 1), &mask, log_q);
    sum += static_cast<double>(log_q[0]);
  }
  return sum / static_cast<double>(held);
}

// Var(r_Q) = Var_s(E_a r) + E_s(Var_a r): the share of the second, over fresh actions at fixed
// states.
double Guide::action_variance_share(const PolicyView& policy, const Matrix<float>& states, Index n,
                                    RandomStream& random) {
  const Index count = std::min(kDiagnosticStates, n);
  const auto state = [&](Index s) { return states.col(s * n / count).data(); };
  for (Index s = 0; s < count; ++s) show_policy(policy, state(s), s);
  run_policy(policy, count);
  for (Index s = 0; s < count; ++s)
    for (Index k = 0; k < kActionsAState; ++k) {
      const Index j = s * kActionsAState + k;
      act(policy, s, random, fresh_actions_.col(j).data());
      build_input(state(s), fresh_actions_.col(j).data(), diagnostic_x_.col(j).data());
    }
  run_guide(count * kActionsAState);
  double within = 0, sum = 0, squares = 0;
  for (Index s = 0; s < count; ++s) {
    const Index column = sees_action() ? target_column(state(s), random) : 0;
    double state_sum = 0, state_squares = 0;
    for (Index k = 0; k < kActionsAState; ++k) {
      const Index j = s * kActionsAState + k;
      const float* output = tape_.outputs.back().col(j).data();
      const auto r = static_cast<double>(
          sees_action() ? reward(output, demos_.actions.col(column).data(),
                                 demos_.available.col(column).data())
                        : reward(output, fresh_actions_.col(j).data(), known_dimensions_.data()));
      state_sum += r;
      state_squares += r * r;
    }
    within += state_squares - state_sum * state_sum / kActionsAState;
    sum += state_sum;
    squares += state_squares;
  }
  const double total = squares - sum * sum / static_cast<double>(count * kActionsAState);
  return total > 0 ? std::clamp(within / total, 0.0, 1.0) : 0;
}

void Guide::archive(Archive& a) {
  a("theta", all_of(theta_));
  a.scope("adam", [&](Archive& inner) { adam_.archive(inner); });
}

}  // namespace agail
