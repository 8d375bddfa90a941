#include "agail/imitation/discriminator.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "agail/base/random.h"
#include "agail/imitation/demo_data.h"

namespace agail {

namespace {

template <class S>
S softplus(S d) {  // log(1 + e^d) without overflow
  return std::max(d, S(0)) + std::log1p(std::exp(-std::abs(d)));
}

template <class S>
S sigmoid(S d) {
  return d >= 0 ? S(1) / (S(1) + std::exp(-d)) : std::exp(d) / (S(1) + std::exp(d));
}

std::vector<Index> all_or(const Sizes& features, int observation_dim) {
  check_features(features, observation_dim);
  std::vector<Index> result(features.begin(), features.end());
  if (result.empty()) {
    result.resize(static_cast<std::size_t>(observation_dim));
    std::iota(result.begin(), result.end(), Index{0});
  }
  return result;
}

}  // namespace

void check_features(const Sizes& features, int observation_dim) {
  for (const std::int64_t feature : features)
    if (feature < 0 || feature >= observation_dim)
      throw InputError("setting discriminator.features: index " + std::to_string(feature) +
                       " is outside the observation; give indices from 0 to " +
                       std::to_string(observation_dim - 1));
}

template <class S>
DiscriminatorLoss<S>::DiscriminatorLoss(const Mlp<S>& mlp, const DiscriminatorSettings& settings,
                                        ThreadPool& pool)
    : mlp_(mlp),
      settings_(settings),
      pool_(pool),
      sums_(mlp.parameters(), 3 * chunk_count(settings.minibatch) * kChunk),
      chunk_reports_(Matrix<double>::Zero(4, 3 * chunk_count(settings.minibatch))) {
  for (int i = 0; i < pool.threads(); ++i)
    workers_.push_back({mlp.make_scratch(), Matrix<S>::Zero(1, kChunk)});
}

template <class S>
DiscriminatorReport DiscriminatorLoss<S>::gradient(const Vector<S>& theta, const Matrix<S>& x,
                                                   const Matrix<S>& between, Vector<S>& result) {
  const Index m = settings_.minibatch;
  const Index rows = mlp_.inputs() + 1;
  const bool penalised = settings_.gradient_penalty > 0;
  // Chunks of policy samples, of demonstrations, of points between; each kind starts a chunk of its
  // own.
  const Index kind_chunks = chunk_count(m);
  const auto scale = static_cast<S>(1.0 / static_cast<double>(m));
  const auto entropy = static_cast<S>(settings_.entropy_weight);

  result = sums_.sum(
      pool_, (penalised ? 3 : 2) * kind_chunks * kChunk,
      [&](Index chunk, int w, Index, Index, S* out) {
        Worker& worker = workers_[static_cast<std::size_t>(w)];
        const Index kind = chunk / kind_chunks;
        const Index first = chunk % kind_chunks * kChunk;
        const Index n = std::min(kChunk, m - first);
        auto report = chunk_reports_.col(chunk);
        report.setZero();
        Tape<S>& tape = worker.scratch.tape;
        if (kind == 2) {
          const auto points = between.block(0, first, rows, n);
          mlp_.forward(theta.data(), points, tape, 0);
          std::fill_n(out, mlp_.parameters(), S(0));
          report[3] = mlp_.add_gradient_penalty(theta.data(), points, tape, 0,
                                                static_cast<S>(settings_.gradient_penalty) * scale,
                                                out, worker.scratch);
          return;
        }
        const auto samples = x.block(0, kind * m + first, rows, n);
        mlp_.forward(theta.data(), samples, tape, 0);
        View<S> adjoint = worker.adjoint.leftCols(n);
        for (Index j = 0; j < n; ++j) {
          const S d = tape.outputs.back()(0, j);
          const S p = sigmoid(d);
          // -log(1 - P) = softplus(d), derivative P;  -log P = softplus(-d), derivative P - 1;
          // H = softplus(d) - d P, derivative -d P (1 - P), averaged over both kinds.
          const S h = softplus(d) - d * p;
          adjoint(0, j) =
              scale * ((kind == 0 ? p : p - S(1)) + S(0.5) * entropy * d * p * (S(1) - p));
          report[0] += static_cast<double>(
              scale * ((kind == 0 ? softplus(d) : softplus(-d)) - S(0.5) * entropy * h));
          const bool right = kind == 0 ? d < S(0) : d > S(0);
          report[1 + kind] += right ? static_cast<double>(scale) : 0.0;
        }
        mlp_.backward(theta.data(), samples, tape, 0, adjoint, out, worker.scratch);
      });
  const Index chunks = (penalised ? 3 : 2) * kind_chunks;
  const Eigen::Vector4d total = chunk_reports_.leftCols(chunks).rowwise().sum();
  return {total[0] + total[3], total[1], total[2], total[3]};
}

template class DiscriminatorLoss<float>;
template class DiscriminatorLoss<double>;

Discriminator::Discriminator(int observation_dim, const ActionSpace& action, bool with_actions,
                             const DiscriminatorSettings& settings, double clip, Team team,
                             Index capacity, std::uint64_t seed)
    : settings_(settings),
      action_(action),
      with_actions_(with_actions),
      features_(all_or(settings.features, observation_dim)),
      team_(team),
      seed_(seed),
      normalizer_(static_cast<Index>(features_.size()), settings.normalize_observations, clip),
      mlp_(layer_sizes(normalizer_.size() + (with_actions ? action.encoded_dim() : 0),
                       settings.hidden, 1),
           Activation::kTanh),
      theta_(Vector<float>::Zero(mlp_.parameters())),
      adam_(mlp_.parameters()),
      loss_(mlp_, settings, team.pool()),
      minibatch_(Matrix<float>::Zero(padded(mlp_.inputs() + 1), 2 * settings.minibatch)),
      between_(Matrix<float>::Zero(padded(mlp_.inputs() + 1), settings.minibatch)),
      new_states_(
          Matrix<float>::Zero(normalizer_.size(), 2 * settings.minibatch * settings.minibatches)),
      gradient_(Vector<float>::Zero(mlp_.parameters())) {
  RandomStream random(seed, Purpose::kInitialise, 2);
  mlp_.initialise(theta_.data(), random, 0.1);
  for (int i = 0; i < team.pool().threads(); ++i)
    workers_.push_back(
        {mlp_.make_tape(kChunk), Matrix<float>::Zero(padded(mlp_.inputs() + 1), kChunk)});
  policy_order_.reserve(static_cast<std::size_t>(capacity));
}

void Discriminator::build_input(const Samples& samples, Index column, float* x) const {
  // Features straight into x, normalised in place, then the action and the one.
  const Index n = normalizer_.size();
  for (Index i = 0; i < n; ++i)
    x[i] = samples.states(features_[static_cast<std::size_t>(i)], column);
  normalizer_.apply(x, x);
  if (with_actions_) encode_action(action_, samples.actions.col(column).data(), x + n);
  x[mlp_.inputs()] = 1;
}

DiscriminatorReport Discriminator::learn(const Samples& policy, const Samples& demos,
                                         const std::vector<Index>& demo_columns,
                                         std::uint32_t update) {
  const Index m = settings_.minibatch;
  const Index wanted = m * settings_.minibatches;
  RandomStream random(seed_, Purpose::kDiscriminator, 0, update);

  // Policy samples without replacement, over again if the batch is smaller; demonstrations with
  // replacement.
  policy_order_.resize(static_cast<std::size_t>(policy.n));
  std::iota(policy_order_.begin(), policy_order_.end(), Index{0});
  shuffle(policy_order_, random);
  demo_order_.resize(static_cast<std::size_t>(wanted));
  for (Index& column : demo_order_)
    column = demo_columns[random.below(static_cast<std::uint32_t>(demo_columns.size()))];
  const auto policy_column = [&](Index k) {
    return policy_order_[static_cast<std::size_t>(k % policy.n)];
  };
  const auto demo_column = [&](Index k) { return demo_order_[static_cast<std::size_t>(k)]; };

  for (Index k = 0; k < wanted; ++k)
    for (Index i = 0; i < normalizer_.size(); ++i) {
      const Index feature = features_[static_cast<std::size_t>(i)];
      new_states_(i, 2 * k) = policy.states(feature, policy_column(k));
      new_states_(i, 2 * k + 1) = demos.states(feature, demo_column(k));
    }
  normalizer_.update(team_.pool(), new_states_);

  DiscriminatorReport report;
  const double share = 1.0 / static_cast<double>(settings_.minibatches);
  for (Index step = 0; step < settings_.minibatches; ++step) {
    for (Index j = 0; j < m; ++j) {
      build_input(policy, policy_column(step * m + j), minibatch_.col(j).data());
      build_input(demos, demo_column(step * m + j), minibatch_.col(m + j).data());
      if (settings_.gradient_penalty > 0) {
        const auto at = static_cast<float>(random.uniform());
        between_.col(j) = at * minibatch_.col(j) + (1 - at) * minibatch_.col(m + j);
        between_(mlp_.inputs(), j) = 1;
      }
    }
    const DiscriminatorReport one = loss_.gradient(theta_, minibatch_, between_, gradient_);
    adam_.descend(team_.pool(), theta_, gradient_, settings_.learning_rate);
    report.loss += share * one.loss;
    report.policy_accuracy += share * one.policy_accuracy;
    report.demo_accuracy += share * one.demo_accuracy;
    report.gradient_penalty += share * one.gradient_penalty;
  }
  return report;
}

void Discriminator::rewards(const Samples& policy, Vector<float>& rewards) {
  const std::string& form = settings_.reward;
  const int kind = form == "softplus" ? 0 : form == "log-odds" ? 1 : form == "probability" ? 2 : 3;
  for_each_chunk(team_, policy.n, [&](int w, Index first, Index n) {
    auto& [tape, x] = workers_[static_cast<std::size_t>(w)];
    for (Index j = 0; j < n; ++j) build_input(policy, first + j, x.col(j).data());
    mlp_.forward(theta_.data(), x.block(0, 0, mlp_.inputs() + 1, n), tape, 0);
    for (Index j = 0; j < n; ++j) {
      const float d = tape.outputs.back()(0, j);
      rewards[first + j] = kind == 0   ? softplus(d)
                           : kind == 1 ? d
                           : kind == 2 ? sigmoid(d)
                                       : -softplus(-d);
    }
  });
  gather_chunks(team_, policy.n, rewards);
}

void Discriminator::archive(Archive& a) {
  a("theta", all_of(theta_));
  a.scope("adam", [&](Archive& inner) { adam_.archive(inner); });
  a.scope("normalizer", [&](Archive& inner) { normalizer_.archive(inner); });
}

}  // namespace agail
