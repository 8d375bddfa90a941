#include "agail/rl/policy_objective.h"

#include <cmath>

namespace agail {

template <class S>
PolicyObjective<S>::PolicyObjective(const PolicyNetwork<S>& network, Team team, Index capacity,
                                    int fisher_stride)
    : network_(network),
      team_(team),
      fisher_stride_(fisher_stride),
      theta_old_(Vector<S>::Zero(network.parameters())),
      old_output_(Matrix<S>::Zero(padded(network.mlp.outputs()), capacity)),
      fisher_tape_(network.mlp.make_tape((capacity + fisher_stride - 1) / fisher_stride)),
      fisher_x_(Matrix<S>::Zero(padded(network.mlp.inputs() + 1),
                                (capacity + fisher_stride - 1) / fisher_stride)),
      old_log_prob_(RowVector<S>::Zero(capacity)),
      parameter_sums_(network.parameters(), capacity),
      scalar_sums_(3, capacity),
      gradient_(Vector<S>::Zero(network.parameters())) {
  for (int i = 0; i < team.pool().threads(); ++i)
    workers_.push_back({network.mlp.make_scratch(),
                        Matrix<S>::Zero(padded(network.mlp.outputs()), kChunk),
                        RowVector<S>::Zero(kChunk)});
}

template <class S>
void PolicyObjective<S>::bind(const Vector<S>& theta_old, const Matrix<S>& x,
                              const Matrix<S>& actions, const Vector<S>& advantages, Index n,
                              S entropy_weight) {
  theta_old_ = theta_old;
  x_ = &x;
  actions_ = &actions;
  advantages_ = &advantages;
  n_ = n;
  entropy_weight_ = entropy_weight;
  compute_gradient();

  const auto& mlp = network_.mlp;
  const Index rows = mlp.inputs() + 1;
  fisher_n_ = (n + fisher_stride_ - 1) / fisher_stride_;
  for_each_chunk(team_, fisher_n_, [&](int, Index first, Index count) {
    for (Index j = first; j < first + count; ++j)
      fisher_x_.col(j).head(rows) = x.col(j * fisher_stride_).head(rows);
    mlp.forward(theta_old_.data(), fisher_x_.block(0, first, rows, count), fisher_tape_, first);
  });
}

template <class S>
void PolicyObjective<S>::compute_gradient() {
  const auto& mlp = network_.mlp;
  const S* theta = theta_old_.data();
  const S scale = S(1) / static_cast<S>(n_);
  gradient_ = parameter_sums_.sum(team_, n_, [&](Index, int w, Index first, Index count, S* out) {
    Worker& worker = workers_[static_cast<std::size_t>(w)];
    const auto x = x_->block(0, first, mlp.inputs() + 1, count);
    mlp.forward(theta, x, worker.scratch.tape, 0);
    View<S> output = old_output_.block(0, first, mlp.outputs(), count);
    output = mlp.output(worker.scratch.tape, 0, count);
    const auto actions = actions_->block(0, first, actions_->rows(), count);
    network_.distribution.log_prob(output, network_.log_std(theta), actions, nullptr,
                                   old_log_prob_.segment(first, count));
    View<S> adjoint = worker.adjoint.block(0, 0, mlp.outputs(), count);
    S* d_log_std = network_.log_std(out);
    std::fill_n(d_log_std, network_.distribution.log_stds(), S(0));
    // At theta_old the ratio is 1 and its gradient that of log pi.
    auto weight = worker.row.head(count);
    weight = scale * advantages_->segment(first, count).transpose();
    network_.distribution.score(output, network_.log_std(theta), actions, nullptr, weight, adjoint,
                                d_log_std);
    if (entropy_weight_ != S(0))
      network_.distribution.add_entropy_gradient(output, scale * entropy_weight_, adjoint,
                                                 d_log_std);
    mlp.backward(theta, x, worker.scratch.tape, 0, adjoint, out, worker.scratch);
  });
}

template <class S>
void PolicyObjective<S>::fisher_vector_product(const Vector<S>& v, Vector<S>& result) {
  const auto& mlp = network_.mlp;
  const S* theta = theta_old_.data();
  const S scale = S(1) / static_cast<S>(fisher_n_);
  const Index log_stds = network_.distribution.log_stds();
  result =
      parameter_sums_.sum(team_, fisher_n_, [&](Index, int w, Index first, Index count, S* out) {
        Worker& worker = workers_[static_cast<std::size_t>(w)];
        const auto x = fisher_x_.block(0, first, mlp.inputs() + 1, count);
        View<S> tangent = worker.adjoint.block(0, 0, mlp.outputs(), count);
        mlp.tangent(theta, v.data(), x, fisher_tape_, first, worker.scratch, tangent);
        network_.distribution.multiply_by_fisher(mlp.output(fisher_tape_, first, count),
                                                 network_.log_std(theta), tangent);
        tangent *= scale;
        mlp.backward(theta, x, fisher_tape_, first, tangent, out, worker.scratch);
        std::fill_n(network_.log_std(out), log_stds, S(0));
      });
  result.tail(log_stds) = S(2) * v.tail(log_stds);  // the Fisher matrix of log_std is 2 I
}

template <class S>
typename PolicyObjective<S>::Value PolicyObjective<S>::evaluate(const Vector<S>& theta) {
  const auto& mlp = network_.mlp;
  const auto& distribution = network_.distribution;
  const auto total =
      scalar_sums_.sum(team_, n_, [&](Index, int w, Index first, Index count, double* out) {
        Worker& worker = workers_[static_cast<std::size_t>(w)];
        Tape<S>& tape = worker.scratch.tape;
        mlp.forward(theta.data(), x_->block(0, first, mlp.inputs() + 1, count), tape, 0);
        const auto output = mlp.output(tape, 0, count);
        auto row = worker.row.head(count);
        distribution.log_prob(output, network_.log_std(theta.data()),
                              actions_->block(0, first, actions_->rows(), count), nullptr, row);
        out[0] = 0;
        for (Index j = 0; j < count; ++j)
          out[0] += static_cast<double>(std::exp(row[j] - old_log_prob_[first + j]) *
                                        (*advantages_)[first + j]);
        distribution.kl(old_output_.block(0, first, mlp.outputs(), count),
                        network_.log_std(theta_old_.data()), output, network_.log_std(theta.data()),
                        row);
        out[1] = 0;
        for (Index j = 0; j < count; ++j) out[1] += static_cast<double>(row[j]);
        out[2] = distribution.entropy(output, network_.log_std(theta.data()));
      });
  return mean(total);
}

template <class S>
typename PolicyObjective<S>::Value PolicyObjective<S>::evaluate_old() {
  const auto total =
      scalar_sums_.sum(team_, n_, [&](Index, int, Index first, Index count, double* out) {
        out[0] = 0;
        for (Index j = 0; j < count; ++j) out[0] += static_cast<double>((*advantages_)[first + j]);
        out[1] = 0;
        out[2] = network_.distribution.entropy(
            old_output_.block(0, first, network_.mlp.outputs(), count),
            network_.log_std(theta_old_.data()));
      });
  return mean(total);
}

template <class S>
typename PolicyObjective<S>::Value PolicyObjective<S>::mean(
    const Eigen::Map<Vector<double>>& total) const {
  const auto n = static_cast<double>(n_);
  Value value{total[0] / n, total[1] / n, total[2] / n};
  value.surrogate += static_cast<double>(entropy_weight_) * value.entropy;
  return value;
}

template class PolicyObjective<float>;
template class PolicyObjective<double>;

}  // namespace agail
