#include "agail/rl/value_function.h"

#include <cmath>
#include <numeric>

#include "agail/base/random.h"

namespace agail {

ValueFunction::ValueFunction(int observation_dim, const ValueSettings& settings, Team team,
                             Index capacity, std::uint64_t seed)
    : settings_(settings),
      team_(team),
      seed_(seed),
      mlp_(layer_sizes(observation_dim, settings.hidden, 1), Activation::kTanh),
      theta_(Vector<float>::Zero(mlp_.parameters())),
      adam_(mlp_.parameters()),
      sums_(mlp_.parameters(), settings.minibatch) {
  RandomStream random(seed, Purpose::kInitialise, 1);
  mlp_.initialise(theta_.data(), random, 0.1);
  order_.reserve(static_cast<std::size_t>(capacity));
  for (int i = 0; i < team.pool().threads(); ++i)
    workers_.push_back({mlp_.make_scratch(), Matrix<float>::Zero(1, kChunk),
                        Matrix<float>::Zero(padded(mlp_.inputs() + 1), kChunk),
                        RowVector<float>::Zero(kChunk)});
}

void ValueFunction::predict(const Matrix<float>& x, Index n, Vector<float>& values) {
  for_each_chunk(team_, n, [&](int w, Index first, Index count) {
    Tape<float>& tape = workers_[static_cast<std::size_t>(w)].scratch.tape;
    mlp_.forward(theta_.data(), x.block(0, first, mlp_.inputs() + 1, count), tape, 0);
    values.segment(first, count) =
        (mlp_.output(tape, 0, count).row(0).array() * static_cast<float>(std_) +
         static_cast<float>(mean_))
            .transpose();
  });
  gather_chunks(team_, n, values);
}

void ValueFunction::follow(const Vector<float>& targets, Index n) {
  const Vector<float>::ConstSegmentReturnType batch = targets.head(n);
  const double batch_mean = batch.cast<double>().sum() / static_cast<double>(n);
  const double batch_square = batch.cast<double>().squaredNorm() / static_cast<double>(n);
  // An average that starts as the plain mean and forgets with a horizon of 20 batches.
  count_ = std::min(count_ + 1, 20.0);
  const double old_mean = mean_;
  const double old_std = std_;
  mean_ += (batch_mean - mean_) / count_;
  second_moment_ += (batch_square - second_moment_) / count_;
  std_ = std::sqrt(std::max(second_moment_ - mean_ * mean_, 1e-4));
  const Index last = mlp_.offset(mlp_.layers() - 1);
  const Index weights = mlp_.parameters() - last - 1;
  theta_.segment(last, weights) *= static_cast<float>(old_std / std_);
  float& bias = theta_[mlp_.parameters() - 1];
  bias = static_cast<float>((old_std * static_cast<double>(bias) + old_mean - mean_) / std_);
}

void ValueFunction::fit(const Matrix<float>& x, const Vector<float>& targets, Index n,
                        std::uint32_t update) {
  if (settings_.normalize_targets) follow(targets, n);
  order_.resize(static_cast<std::size_t>(n));
  const Index rows = mlp_.inputs() + 1;
  for (int epoch = 0; epoch < settings_.epochs; ++epoch) {
    std::iota(order_.begin(), order_.end(), Index{0});
    RandomStream random(seed_, Purpose::kShuffle, 1, update, static_cast<std::uint32_t>(epoch));
    shuffle(order_, random);
    for (Index start = 0; start < n; start += settings_.minibatch) {
      const Index size = std::min<Index>(settings_.minibatch, n - start);
      const auto learn_chunk = [&](Index, int w, Index first, Index count, float* out) {
        Worker& worker = workers_[static_cast<std::size_t>(w)];
        Tape<float>& tape = worker.scratch.tape;
        View<float> adjoint = worker.adjoint.leftCols(count);
        for (Index j = 0; j < count; ++j) {
          const Index from = order_[static_cast<std::size_t>(start + first + j)];
          worker.x.col(j).head(rows) = x.col(from).head(rows);
          worker.target[j] = (targets[from] - static_cast<float>(mean_)) / static_cast<float>(std_);
        }
        const auto columns = worker.x.block(0, 0, rows, count);
        mlp_.forward(theta_.data(), columns, tape, 0);
        adjoint =
            (mlp_.output(tape, 0, count) - worker.target.head(count)) / static_cast<float>(size);
        mlp_.backward(theta_.data(), columns, tape, 0, adjoint, out, worker.scratch);
      };
      const auto step = adam_.begin_step(settings_.learning_rate);
      sums_.sum(team_, size, learn_chunk, [&](Index first, const auto& gradient) {
        adam_.descend(step, theta_.segment(first, gradient.size()), gradient, first);
      });
    }
  }
}

void ValueFunction::archive(Archive& a) {
  a("theta", all_of(theta_));
  a("mean", mean_);
  a("std", std_);
  a("count", count_);
  a("second_moment", second_moment_);
  a.scope("adam", [&](Archive& inner) { adam_.archive(inner); });
}

}  // namespace agail
