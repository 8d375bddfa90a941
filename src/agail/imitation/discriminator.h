// The discriminator: P(x) = sigmoid(d(x)), the probability that x comes from the demonstrations. x
// is a state, some features of it, or a state and an action. (The paper's D is 1 - P.)
//
//   minimise  -E_demo log P - E_policy log(1 - P) - c H(P) + w E (|grad_x d| - 1)^2
//
// Ho & Ermon, "Generative Adversarial Imitation Learning", 2016, eq. 15; gradient penalty:
// Gulrajani et al., 2017.
#pragma once

#include "agail/base/archive.h"
#include "agail/base/spaces.h"
#include "agail/config/settings.h"
#include "agail/nn/adam.h"
#include "agail/nn/chunks.h"
#include "agail/nn/mlp.h"
#include "agail/nn/normalizer.h"

namespace agail {

struct DiscriminatorReport {  // means over the last update's minibatches
  double loss = 0;
  double policy_accuracy = 0;  // share of policy samples with P < 1/2
  double demo_accuracy = 0;    // share of demonstrated samples with P > 1/2
  double gradient_penalty = 0;
};

// Loss of a minibatch and its gradient; on any scalar type, so that tests can check it in double
// precision. x: columns [0, m) from the policy, [m, 2m) from the demonstrations; between: m
// columns, used if the penalty's weight is not 0; all with a last row of ones.
template <class S>
class DiscriminatorLoss {
 public:
  DiscriminatorLoss(const Mlp<S>& mlp, const DiscriminatorSettings& settings, ThreadPool& pool);
  // Writes the gradient; returns the report of this minibatch.
  DiscriminatorReport gradient(const Vector<S>& theta, const Matrix<S>& x, const Matrix<S>& between,
                               Vector<S>& result);

 private:
  const Mlp<S>& mlp_;
  DiscriminatorSettings settings_;
  ThreadPool& pool_;
  ChunkSums<S> sums_;
  Matrix<double> chunk_reports_;
  struct Worker {
    Scratch<S> scratch;
    Matrix<S> adjoint;
  };
  std::vector<Worker> workers_;
};

extern template class DiscriminatorLoss<float>;
extern template class DiscriminatorLoss<double>;

// InputError if a feature is not in the observation; a Discriminator checks it, too.
void check_features(const Sizes& features, int observation_dim);

class Discriminator {
 public:
  // Sees settings.features of the state (all if empty) and, if `with_actions`, the encoded action.
  Discriminator(int observation_dim, const ActionSpace& action, bool with_actions,
                const DiscriminatorSettings& settings, double clip, Team team, Index capacity,
                std::uint64_t seed);

  // Samples as the discriminator takes them. states: observation_dim x n; actions: action_dim x n
  // (executed), ignored if it does not see them.
  struct Samples {
    const Matrix<float>& states;
    const Matrix<float>& actions;
    Index n = 0;
  };

  // settings.minibatches steps of Adam, on equal numbers of policy and demonstration samples.
  // `demo_columns`: which demonstrated samples may be drawn. `update` numbers the call, so that
  // each draws its own samples.
  DiscriminatorReport learn(const Samples& policy, const Samples& demos,
                            const std::vector<Index>& demo_columns, std::uint32_t update);

  // rewards[j] of the policy's samples: softplus(d) = -log(1 - P) | d | P | log P.
  void rewards(const Samples& policy, Vector<float>& rewards);

  bool has_learned() const { return adam_.steps() > 0; }
  void archive(Archive& a);

 private:
  void build_input(const Samples& samples, Index column, float* x) const;

  DiscriminatorSettings settings_;
  ActionSpace action_;
  bool with_actions_;
  std::vector<Index> features_;
  Team team_;
  std::uint64_t seed_;
  Normalizer normalizer_;  // of the features; actions are seen as they are
  Mlp<float> mlp_;
  Vector<float> theta_;
  Adam<float> adam_;
  DiscriminatorLoss<float> loss_;
  Matrix<float> minibatch_, between_, new_states_;
  Vector<float> gradient_;
  std::vector<Index> policy_order_, demo_order_;
  struct Worker {  // of rewards(): a chunk
    Tape<float> tape;
    Matrix<float> x;
  };
  std::vector<Worker> workers_;
};

}  // namespace agail
