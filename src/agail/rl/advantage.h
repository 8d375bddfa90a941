// Generalised advantage estimation (Schulman et al., "High-dimensional continuous control using
// GAE", 2016):
//   delta_t = r_t + gamma V(s_{t+1}) - V(s_t),   A_t = delta_t + gamma lambda A_{t+1}
// Where an episode terminates, V(s_{t+1}) is `terminal_value` (0: the reward ends there); where the
// time limit truncates it or the batch ends, it is the network's value of the state that followed.
#pragma once

#include "agail/rl/rollout.h"
#include "agail/rl/value_function.h"

namespace agail {

class AdvantageEstimator {
 public:
  AdvantageEstimator(int observation_dim, Index capacity);

  // From batch.inputs and `rewards` (n): values V(s_t), advantages A_t and the value net's targets
  // A_t + V(s_t).
  void estimate(const Batch& batch, const Vector<float>& rewards, ValueFunction& value,
                const Normalizer& normalizer, const TrpoSettings& settings, double terminal_value);

  const Vector<float>& advantages() const { return advantages_; }
  const Vector<float>& targets() const { return targets_; }
  const Vector<float>& values() const { return values_; }
  // Mean 0, standard deviation 1.
  void normalize(Index n);
  // 1 - Var(target - V) / Var(target): 1 is a perfect value net, 0 a constant.
  double explained_variance(Index n) const;

 private:
  Vector<float> values_, advantages_, targets_, final_values_, next_values_;
  Matrix<float> final_inputs_;
};

}  // namespace agail
