#include "agail/imitation/action_regression.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "agail/base/interrupt.h"
#include "agail/nn/adam.h"
#include "agail/nn/chunks.h"

namespace agail {

namespace {

// Loss and gradient of one set of columns, gathered.
class RegressionLoss {
 public:
  RegressionLoss(const PolicyNetwork<float>& network, ThreadPool& pool, Index capacity,
                 Index inputs, Index actions)
      : network_(network),
        pool_(pool),
        x_(Matrix<float>::Zero(inputs, capacity)),
        actions_(Matrix<float>::Zero(actions, capacity)),
        available_(actions_),
        tape_(network.mlp.make_tape(capacity)),
        sums_(network.mlp.parameters() + 1, capacity),
        unit_log_std_(Vector<float>::Zero(network.distribution.log_stds())),
        gradient_(Vector<float>::Zero(network.mlp.parameters())) {
    for (int i = 0; i < pool.threads(); ++i) scratch_.push_back(network.mlp.make_scratch());
  }

  // Mean over the columns. With a unit standard deviation -log p is |a - mean|^2 / 2 and a
  // constant, left out.
  double loss(const Vector<float>& theta, const Matrix<float>& x, const Matrix<float>& actions,
              const Matrix<float>& available, const Index* columns, Index n) {
    for (Index j = 0; j < n; ++j) {
      x_.col(j) = x.col(columns[j]).head(x_.rows());
      actions_.col(j) = actions.col(columns[j]);
      available_.col(j) = available.col(columns[j]);
    }
    const auto& mlp = network_.mlp;
    const auto& distribution = network_.distribution;
    const auto total = sums_.sum(pool_, n, [&](Index, int w, Index first, Index count, float* out) {
      Scratch<float>& scratch = scratch_[static_cast<std::size_t>(w)];
      const auto input = x_.block(0, first, mlp.inputs() + 1, count);
      mlp.forward(theta.data(), input, tape_, first);
      const auto output = mlp.output(tape_, first, count);
      const auto action = actions_.block(0, first, actions_.rows(), count);
      const ConstView<float> mask = available_.block(0, first, available_.rows(), count);
      RowVector<float> weight = RowVector<float>::Constant(count, -1.0F / static_cast<float>(n));
      Vector<float> no_log_std = Vector<float>::Zero(unit_log_std_.size());
      View<float> adjoint = scratch.d.block(0, 0, mlp.outputs(), count);
      distribution.score(output, unit_log_std_.data(), action, &mask, weight, adjoint,
                         no_log_std.data());
      if (distribution.discrete()) {
        RowVector<float> log_p(count);
        distribution.log_prob(output, nullptr, action, &mask, log_p);
        out[mlp.parameters()] = log_p.dot(weight);
      } else {
        out[mlp.parameters()] = 0.5F * ((action - output).array().square() * mask.array()).sum() /
                                static_cast<float>(n);
      }
      mlp.backward(theta.data(), input, tape_, first, adjoint, out, scratch);
    });
    gradient_ = total.head(mlp.parameters());
    return static_cast<double>(total[mlp.parameters()]);
  }

  const Vector<float>& gradient() const { return gradient_; }

  // Share of the entries' variance that the outputs explain, or of the actions that are the most
  // likely one.
  double quality(Index n) const {
    const auto output = network_.mlp.output(tape_, 0, n);
    if (network_.distribution.discrete()) {
      Index right = 0, known = 0;
      for (Index j = 0; j < n; ++j) {
        if (available_(0, j) == 0) continue;
        Index best = 0;
        output.col(j).maxCoeff(&best);
        right += best == static_cast<Index>(actions_(0, j)) ? 1 : 0;
        ++known;
      }
      return known > 0 ? static_cast<double>(right) / static_cast<double>(known) : 0;
    }
    double error = 0, variance = 0;
    for (Index i = 0; i < actions_.rows(); ++i) {
      double sum = 0, squares = 0, count = 0;
      for (Index j = 0; j < n; ++j) {
        if (available_(i, j) == 0) continue;
        const auto a = static_cast<double>(actions_(i, j));
        const double e = a - static_cast<double>(output(i, j));
        error += e * e;
        sum += a;
        squares += a * a;
        count += 1;
      }
      if (count > 0) variance += squares - sum * sum / count;
    }
    return variance > 0 ? 1 - error / variance : 0;
  }

 private:
  const PolicyNetwork<float>& network_;
  ThreadPool& pool_;
  Matrix<float> x_, actions_, available_;
  Tape<float> tape_;
  ChunkSums<float> sums_;
  Vector<float> unit_log_std_, gradient_;
  std::vector<Scratch<float>> scratch_;
};

}  // namespace

RegressionReport fit_actions(const PolicyNetwork<float>& network, Vector<float>& theta,
                             const Matrix<float>& x, const Matrix<float>& actions,
                             const Matrix<float>& available, std::vector<Index> columns,
                             const RegressionSettings& settings, ThreadPool& pool,
                             std::uint64_t seed, Purpose purpose) {
  AGAIL_CHECK(!columns.empty());
  RandomStream split(seed, Purpose::kHoldout, static_cast<std::uint32_t>(purpose), 0,
                     settings.round);
  shuffle(columns, split);
  const auto n = static_cast<Index>(columns.size());
  const auto held = static_cast<Index>(settings.validation_share * static_cast<double>(n));
  const std::vector<Index> validation(columns.begin(), columns.begin() + held);
  std::vector<Index> training(columns.begin() + held, columns.end());
  const auto training_size = static_cast<Index>(training.size());

  const Index inputs = network.mlp.inputs() + 1;
  RegressionLoss minibatches(network, pool, settings.minibatch, inputs, actions.rows());
  RegressionLoss whole(network, pool, std::max<Index>(held, 1), inputs, actions.rows());
  Adam<float> adam(network.mlp.parameters());
  Vector<float> best = theta;
  RegressionReport report;
  double least = std::numeric_limits<double>::infinity();

  // An interrupt ends a fit before training, of which nothing is kept. A later round is part of an
  // update, after which a checkpoint is saved: it is finished first.
  const auto stops = [&] { return settings.round == 0 && interrupted() != 0; };
  for (std::int64_t epoch = 1; epoch <= settings.epochs && !stops(); ++epoch) {
    RandomStream order(seed, purpose, 0, static_cast<std::uint32_t>(epoch), settings.round);
    shuffle(training, order);
    const double rate = settings.learning_rate *
                        (1 - static_cast<double>(epoch - 1) / static_cast<double>(settings.epochs));
    for (Index start = 0; start < training_size; start += settings.minibatch) {
      const Index count = std::min<Index>(settings.minibatch, training_size - start);
      minibatches.loss(theta, x, actions, available, training.data() + start, count);
      adam.descend(pool, theta.head(network.mlp.parameters()), minibatches.gradient(), rate);
    }
    report.epochs = epoch;
    if (held > 0) {
      const double validation_loss =
          whole.loss(theta, x, actions, available, validation.data(), held);
      if (!(validation_loss < least)) continue;  // NaN is no improvement
      least = validation_loss;
      report.validation_loss = validation_loss;
      report.quality = whole.quality(held);
      best = theta;
    }
    report.best_epoch = epoch;
  }
  if (held > 0) theta = best;
  if ((report.epochs > 0 && report.best_epoch == 0) || !theta.allFinite())
    throw InputError(purpose == Purpose::kClone
                         ? "behaviour cloning diverged; lower bc.learning_rate"
                         : "inverse dynamics diverged; lower inverse_dynamics.learning_rate");
  return report;
}

}  // namespace agail
