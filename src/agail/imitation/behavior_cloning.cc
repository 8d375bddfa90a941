#include "agail/imitation/behavior_cloning.h"

#include <cmath>

namespace agail {

RegressionReport clone_policy(const PolicyNetwork<float>& network, const Normalizer& normalizer,
                              const DemoData& demos, const CloningTargets& targets,
                              const BcSettings& settings, bool fit_log_std, ThreadPool& pool,
                              std::uint64_t seed, Vector<float>& theta, std::uint32_t round) {
  Matrix<float> x = Matrix<float>::Zero(padded(network.mlp.inputs() + 1), demos.size());
  normalizer.apply(pool, demos.states, demos.size(), x);
  const RegressionSettings regression{.epochs = settings.epochs,
                                      .learning_rate = settings.learning_rate,
                                      .minibatch = settings.minibatch,
                                      .validation_share = settings.validation_share,
                                      .round = round};
  const RegressionReport report =
      fit_actions(network, theta, x, targets.actions, targets.available, targets.columns,
                  regression, pool, seed, Purpose::kClone);
  if (!fit_log_std || network.distribution.log_stds() == 0) return report;

  Matrix<float> means(network.mlp.outputs(), demos.size());
  std::vector<Tape<float>> tapes;  // one of all steps would be many times the demonstrations' size
  for (int i = 0; i < pool.threads(); ++i) tapes.push_back(network.mlp.make_tape(kChunk));
  for_each_chunk(pool, demos.size(), [&](int worker, Index first, Index count) {
    Tape<float>& tape = tapes[static_cast<std::size_t>(worker)];
    network.mlp.forward(theta.data(), x.block(0, first, network.mlp.inputs() + 1, count), tape, 0);
    means.middleCols(first, count) = network.mlp.output(tape, 0, count);
  });
  for (Index i = 0; i < network.distribution.log_stds(); ++i) {
    double squares = 0, count = 0;
    for (const Index j : targets.columns) {
      if (targets.available(i, j) == 0) continue;
      const auto error = static_cast<double>(targets.actions(i, j) - means(i, j));
      squares += error * error;
      count += 1;
    }
    if (count > 0)
      network.log_std(theta.data())[i] =
          static_cast<float>(std::max(0.5 * std::log(squares / count + 1e-12), -3.0));
  }
  return report;
}

CloningTerm::CloningTerm(const PolicyNetwork<float>& network, const Normalizer& normalizer,
                         const DemoData& demos, const CloningTargets& targets,
                         const CloneSettings& settings, ThreadPool& pool, std::uint64_t seed)
    : network_(network),
      normalizer_(normalizer),
      demos_(demos),
      targets_(targets),
      settings_(settings),
      pool_(pool),
      seed_(seed),
      x_(Matrix<float>::Zero(padded(network.mlp.inputs() + 1), settings.minibatch)),
      actions_(Matrix<float>::Zero(targets_.actions.rows(), settings.minibatch)),
      available_(actions_),
      sums_(network.parameters(), settings.minibatch),
      scalar_sums_(1, settings.minibatch) {
  for (int i = 0; i < pool.threads(); ++i)
    workers_.push_back({network.mlp.make_scratch(), RowVector<float>::Zero(kChunk)});
}

void CloningTerm::begin_update(const Vector<float>& theta) {
  weight_ = settings_.weight * std::pow(settings_.decay, static_cast<double>(update_));
  RandomStream random(seed_, Purpose::kClone, 1, static_cast<std::uint32_t>(update_));
  ++update_;
  for (Index j = 0; j < x_.cols(); ++j) {
    const Index column =
        targets_.columns[random.below(static_cast<std::uint32_t>(targets_.columns.size()))];
    normalizer_.apply(demos_.states.col(column).data(), x_.col(j).data());
    actions_.col(j) = targets_.actions.col(column);
    available_.col(j) = targets_.available.col(column);
  }
  log_likelihood_ = total_log_likelihood(theta) / static_cast<double>(x_.cols());
}

double CloningTerm::value(const Vector<float>& theta) {
  return weight_ * total_log_likelihood(theta) / static_cast<double>(x_.cols());
}

double CloningTerm::total_log_likelihood(const Vector<float>& theta) {
  const auto& mlp = network_.mlp;
  const Index n = x_.cols();
  const auto total =
      scalar_sums_.sum(pool_, n, [&](Index, int w, Index first, Index count, double* out) {
        auto& [scratch, whole_row] = workers_[static_cast<std::size_t>(w)];
        mlp.forward(theta.data(), x_.block(0, first, mlp.inputs() + 1, count), scratch.tape, 0);
        auto row = whole_row.head(count);
        const ConstView<float> mask = available_.block(0, first, available_.rows(), count);
        network_.distribution.log_prob(
            mlp.output(scratch.tape, 0, count), network_.log_std(theta.data()),
            actions_.block(0, first, actions_.rows(), count), &mask, row);
        out[0] = 0;
        for (Index j = 0; j < count; ++j) out[0] += static_cast<double>(row[j]);
      });
  return total[0];
}

void CloningTerm::add_gradient(const Vector<float>& theta, Vector<float>& gradient) {
  const auto& mlp = network_.mlp;
  const Index n = x_.cols();
  gradient += sums_.sum(pool_, n, [&](Index, int w, Index first, Index count, float* out) {
    Worker& worker = workers_[static_cast<std::size_t>(w)];
    const auto input = x_.block(0, first, mlp.inputs() + 1, count);
    Tape<float>& tape = worker.scratch.tape;
    mlp.forward(theta.data(), input, tape, 0);
    auto weight = worker.row.head(count);
    weight.setConstant(static_cast<float>(weight_ / static_cast<double>(n)));
    const ConstView<float> mask = available_.block(0, first, available_.rows(), count);
    View<float> adjoint = worker.scratch.d.block(0, 0, mlp.outputs(), count);
    std::fill_n(network_.log_std(out), network_.distribution.log_stds(), 0.0F);
    network_.distribution.score(mlp.output(tape, 0, count), network_.log_std(theta.data()),
                                actions_.block(0, first, actions_.rows(), count), &mask, weight,
                                adjoint, network_.log_std(out));
    mlp.backward(theta.data(), input, tape, 0, adjoint, out, worker.scratch);
  });
}

}  // namespace agail
