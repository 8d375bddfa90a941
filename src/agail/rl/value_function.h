// The state-value network, fitted by regression on lambda-returns.
#pragma once

#include "agail/config/settings.h"
#include "agail/nn/adam.h"
#include "agail/nn/chunks.h"
#include "agail/nn/mlp.h"

namespace agail {

// V(s) = mean + std * network(s), where mean and std follow the targets if `normalize_targets` is
// set; when they move, the last layer is rescaled so that V stays what it was (van Hasselt et al.,
// "Pop-Art", 2016).
class ValueFunction {
 public:
  ValueFunction(int observation_dim, const ValueSettings& settings, Team team, Index capacity,
                std::uint64_t seed);

  // values[j] = V(x_j), j < n. x: (observations + 1) x >= n, last row ones.
  void predict(const Matrix<float>& x, Index n, Vector<float>& values);

  // `epochs` passes of Adam over shuffled minibatches; loss (V - target)^2 / 2 in normalised units.
  // `update` numbers the fits, so that each shuffles in its own order.
  void fit(const Matrix<float>& x, const Vector<float>& targets, Index n, std::uint32_t update);

  bool finite() const { return theta_.allFinite(); }
  void archive(Archive& a);

 private:
  void follow(const Vector<float>& targets, Index n);

  ValueSettings settings_;
  Team team_;
  std::uint64_t seed_;
  Mlp<float> mlp_;
  Vector<float> theta_;
  Adam<float> adam_;
  double mean_ = 0, std_ = 1, count_ = 0, second_moment_ = 0;
  ChunkSums<float> sums_;
  std::vector<Index> order_;
  struct Worker {
    Scratch<float> scratch;
    Matrix<float> adjoint, x;
    RowVector<float> target;
  };
  std::vector<Worker> workers_;
};

}  // namespace agail
