#include "agail/imitation/inverse_dynamics.h"

#include "agail/rl/rollout.h"

namespace agail {

InverseDynamics::InverseDynamics(int observation_dim, const ActionSpace& action,
                                 const InverseDynamicsSettings& settings, double clip,
                                 std::uint64_t seed)
    : dim_(observation_dim),
      action_(action),
      settings_(settings),
      clip_(clip),
      seed_(seed),
      network_(2 * observation_dim, settings.hidden, action),
      theta_(Vector<float>::Zero(network_.parameters())),
      normalizer_(observation_dim, true, clip),
      scale_(Vector<double>::Zero(observation_dim)) {
  RandomStream random(seed, Purpose::kInitialise, 4);
  network_.initialise(theta_.data(), random, 0);
}

Matrix<float> InverseDynamics::inputs(const Transitions& data, Index n) const {
  Matrix<float> x = Matrix<float>::Zero(2 * dim_ + 1, n);
  for (Index j = 0; j < n; ++j) {
    normalizer_.apply(data.states.col(j).data(), x.col(j).data());
    x.col(j).segment(dim_, dim_) =
        ((data.next_states.col(j) - data.states.col(j)).cast<double>().array() * scale_.array())
            .max(-clip_)
            .min(clip_)
            .cast<float>();
    x(2 * dim_, j) = 1;
  }
  return x;
}

RegressionReport InverseDynamics::learn(const Transitions& data, std::vector<Index> columns,
                                        std::int64_t epochs, std::uint32_t round,
                                        ThreadPool& pool) {
  const Index n = data.states.cols();
  normalizer_ = Normalizer(static_cast<int>(dim_), true, clip_);
  normalizer_.update(pool, data.states);
  for (Index i = 0; i < dim_; ++i) {
    const auto difference = data.next_states.row(i) - data.states.row(i);
    const double square = difference.cast<double>().squaredNorm() / static_cast<double>(n);
    scale_[i] = square > 0 ? 1 / std::sqrt(square) : 0;
  }
  const RegressionSettings regression{
      .epochs = epochs, .learning_rate = settings_.learning_rate, .round = round};
  return fit_actions(network_, theta_, inputs(data, n), data.actions, data.available,
                     std::move(columns), regression, pool, seed_, Purpose::kInverseDynamics);
}

void InverseDynamics::infer(const Transitions& data, Index n, const Vector<float>& known,
                            ThreadPool& pool, Matrix<float>& actions,
                            Matrix<float>& available) const {
  const Matrix<float> x = inputs(data, n);
  std::vector<Tape<float>> tapes;  // one of all transitions would be many times their size
  for (int i = 0; i < pool.threads(); ++i) tapes.push_back(network_.mlp.make_tape(kChunk));
  for_each_chunk(pool, n, [&](int worker, Index first, Index count) {
    Tape<float>& tape = tapes[static_cast<std::size_t>(worker)];
    network_.mlp.forward(theta_.data(), x.block(0, first, 2 * dim_ + 1, count), tape, 0);
    std::vector<float> guess(static_cast<std::size_t>(action_.dim));
    for (Index j = first; j < first + count; ++j) {
      network_.distribution.mode(tape.outputs.back().col(j - first).data(), guess.data());
      clip_action(action_, guess.data(), guess.data());
      for (Index i = 0; i < action_.dim; ++i) {
        if (data.available(i, j) == 0 && known[i] != 0)
          actions(i, j) = guess[static_cast<std::size_t>(i)];
        available(i, j) = known[i];
      }
    }
  });
}

RegressionReport infer_missing_actions(const DemoData& demos, const ActionSpace& action,
                                       const InverseDynamicsSettings& settings, double clip,
                                       ThreadPool& pool, std::uint64_t seed, Matrix<float>& actions,
                                       Matrix<float>& available) {
  const Matrix<float> next_states = demos.next_states();
  const Transitions data{demos.states, next_states, demos.actions, demos.available};
  InverseDynamics model(static_cast<int>(demos.states.rows()), action, settings, clip, seed);
  const RegressionReport report = model.learn(data, demos.some_action, settings.epochs, 0, pool);
  actions = demos.actions;
  available = demos.available;
  const Vector<float> known =
      demos.available.rowwise().maxCoeff();  // dimensions that some demonstration tells
  model.infer(data, demos.size(), known, pool, actions, available);
  return report;
}

}  // namespace agail
