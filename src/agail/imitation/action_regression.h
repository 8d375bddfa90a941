// Maximum-likelihood regression of actions on inputs, where only available entries count. Behaviour
// cloning regresses on the state, inverse dynamics on two successive states.
#pragma once

#include <limits>

#include "agail/base/thread_pool.h"
#include "agail/config/settings.h"
#include "agail/rl/policy_network.h"

namespace agail {

struct RegressionReport {
  std::int64_t epochs = 0;      // trained
  std::int64_t best_epoch = 0;  // whose parameters were kept
  // On held-out steps, of the epoch that was kept; NaN if none are held out.
  // Continuous: mean of sum_i (a_i - mean_i)^2 / 2; discrete: -log p(a).
  double validation_loss = std::numeric_limits<double>::quiet_NaN();
  // Continuous: explained variance of the entries; discrete: share right.
  double quality = std::numeric_limits<double>::quiet_NaN();
};

struct RegressionSettings {
  std::int64_t epochs = 200;
  double learning_rate = 1e-3;
  std::int64_t minibatch = 128;
  double validation_share = 0.1;
  std::uint32_t round = 0;  // names the random numbers of a fit that goes on from an earlier one
};

// Fits theta's network part in place with Adam whose rate falls linearly to zero; keeps the
// parameters of the epoch with the least validation loss. x: inputs + row of ones; actions,
// available: action_dim x n. `columns`: the samples that may be used. log_std stays as it is.
// InputError if the loss of every epoch is NaN or infinite: the learning rate is too large.
RegressionReport fit_actions(const PolicyNetwork<float>& network, Vector<float>& theta,
                             const Matrix<float>& x, const Matrix<float>& actions,
                             const Matrix<float>& available, std::vector<Index> columns,
                             const RegressionSettings& settings, ThreadPool& pool,
                             std::uint64_t seed, Purpose purpose);

}  // namespace agail
