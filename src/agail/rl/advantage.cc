#include "agail/rl/advantage.h"

#include <cmath>

namespace agail {

AdvantageEstimator::AdvantageEstimator(int observation_dim, Index capacity)
    : values_(Vector<float>::Zero(capacity)),
      advantages_(values_),
      targets_(values_),
      final_values_(values_),
      next_values_(values_),
      final_inputs_(Matrix<float>::Zero(padded(observation_dim + 1), capacity)) {}

void AdvantageEstimator::estimate(const Batch& batch, const Vector<float>& rewards,
                                  ValueFunction& value, const Normalizer& normalizer,
                                  const TrpoSettings& settings, double terminal_value) {
  const Index n = batch.size();
  value.predict(batch.inputs, n, values_);

  // V(s_{t+1}): the next column's, but for the columns where the next state is not in the batch.
  const auto leaves = [&](Index j) {
    const Ending ending = batch.endings[static_cast<std::size_t>(j)];
    return ending == Ending::kTruncated || (ending == Ending::kNone && batch.lane_ends(j));
  };
  Index finals = 0;
  for (Index j = 0; j < n; ++j)
    if (leaves(j))
      normalizer.apply(batch.final_observations.col(j).data(), final_inputs_.col(finals++).data());
  value.predict(final_inputs_, finals, final_values_);
  finals = 0;
  for (Index j = 0; j < n; ++j) {
    if (leaves(j))
      next_values_[j] = final_values_[finals++];
    else if (batch.endings[static_cast<std::size_t>(j)] == Ending::kTerminated)
      next_values_[j] = static_cast<float>(terminal_value);
    else
      next_values_[j] = values_[j + 1];
  }

  const auto gamma = static_cast<float>(settings.gamma);
  const auto decay = static_cast<float>(settings.gamma * settings.lambda);
  float advantage = 0;
  for (Index j = n - 1; j >= 0; --j) {
    if (batch.lane_ends(j) || batch.endings[static_cast<std::size_t>(j)] != Ending::kNone)
      advantage = 0;
    const float delta = rewards[j] + gamma * next_values_[j] - values_[j];
    advantage = delta + decay * advantage;
    advantages_[j] = advantage;
    targets_[j] = advantage + values_[j];
  }
}

void AdvantageEstimator::normalize(Index n) {
  auto a = advantages_.head(n);
  const double mean = a.cast<double>().sum() / static_cast<double>(n);
  const double square = a.cast<double>().squaredNorm() / static_cast<double>(n) - mean * mean;
  const double scale = 1 / (std::sqrt(std::max(square, 0.0)) + 1e-8);
  a = ((a.cast<double>().array() - mean) * scale).cast<float>();
}

double AdvantageEstimator::explained_variance(Index n) const {
  const auto target = targets_.head(n).cast<double>().array();
  const auto error = target - values_.head(n).cast<double>().array();
  const double total = (target - target.mean()).square().mean();
  return total > 0 ? 1 - (error - error.mean()).square().mean() / total : 0;
}

}  // namespace agail
