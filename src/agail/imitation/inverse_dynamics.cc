#include "agail/imitation/inverse_dynamics.h"

#include "agail/rl/rollout.h"

namespace agail {

RegressionReport infer_missing_actions(const DemoData& demos, const ActionSpace& action,
                                       const InverseDynamicsSettings& settings, double clip,
                                       ThreadPool& pool, std::uint64_t seed, Matrix<float>& actions,
                                       Matrix<float>& available) {
  const Index dim = demos.states.rows();
  const Index n = demos.size();
  // The network sees s and s' - s, each in units of its own deviation: the difference is what an
  // action makes.
  Matrix<float> differences(dim, n);
  for (Index j = 0; j < n; ++j)
    differences.col(j) =
        Eigen::Map<const Vector<float>>(demos.next_state(j), dim) - demos.states.col(j);
  Normalizer state_normalizer(dim, true, clip);
  state_normalizer.update(pool, demos.states);
  Vector<double> scale(dim);
  for (Index i = 0; i < dim; ++i) {
    const double square = differences.row(i).cast<double>().squaredNorm() / static_cast<double>(n);
    scale[i] = square > 0 ? 1 / std::sqrt(square) : 0;
  }
  const PolicyNetwork<float> network(static_cast<int>(2 * dim), settings.hidden, action);
  Matrix<float> x = Matrix<float>::Zero(2 * dim + 1, n);
  for (Index j = 0; j < n; ++j) {
    state_normalizer.apply(demos.states.col(j).data(), x.col(j).data());
    x.col(j).segment(dim, dim) = (differences.col(j).cast<double>().array() * scale.array())
                                     .max(-clip)
                                     .min(clip)
                                     .cast<float>();
    x(2 * dim, j) = 1;
  }

  Vector<float> theta(network.parameters());
  RandomStream random(seed, Purpose::kInitialise, 4);
  network.initialise(theta.data(), random, 0);
  const RegressionSettings regression{.epochs = settings.epochs,
                                      .learning_rate = settings.learning_rate};
  const RegressionReport report =
      fit_actions(network, theta, x, demos.actions, demos.available, demos.some_action, regression,
                  pool, seed, Purpose::kInverseDynamics);

  actions = demos.actions;
  available = demos.available;
  const Vector<float> known =
      demos.available.rowwise().maxCoeff();  // dimensions that some demonstration tells
  std::vector<Tape<float>> tapes;  // one of all demonstrations would be many times their size
  for (int i = 0; i < pool.threads(); ++i) tapes.push_back(network.mlp.make_tape(kChunk));
  for_each_chunk(pool, n, [&](int worker, Index first, Index count) {
    Tape<float>& tape = tapes[static_cast<std::size_t>(worker)];
    network.mlp.forward(theta.data(), x.block(0, first, 2 * dim + 1, count), tape, 0);
    std::vector<float> guess(static_cast<std::size_t>(action.dim));
    for (Index j = first; j < first + count; ++j) {
      network.distribution.mode(tape.outputs.back().col(j - first).data(), guess.data());
      clip_action(action, guess.data(), guess.data());
      for (Index i = 0; i < action.dim; ++i) {
        if (demos.available(i, j) == 0 && known[i] != 0)
          actions(i, j) = guess[static_cast<std::size_t>(i)];
        available(i, j) = known[i];
      }
    }
  });
  return report;
}

}  // namespace agail
