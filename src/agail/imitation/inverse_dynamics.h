// Inverse dynamics: which action led from s to s', learned where the action is available, asked
// where it is missing (Torabi et al., "Behavioral Cloning from Observation", IJCAI 2018,
// section 4.1).
#pragma once

#include "agail/imitation/action_regression.h"
#include "agail/imitation/demo_data.h"
#include "agail/nn/normalizer.h"

namespace agail {

// Transitions of which some tell their action; one a column.
struct Transitions {
  const Matrix<float>& states;       // observation_dim x n
  const Matrix<float>& next_states;  // observation_dim x n
  const Matrix<float>& actions;      // action_dim x n
  const Matrix<float>& available;    // action_dim x n, 1 where known
};

class InverseDynamics {
 public:
  InverseDynamics(int observation_dim, const ActionSpace& action,
                  const InverseDynamicsSettings& settings, double clip, std::uint64_t seed);

  // Takes the scale of its inputs from all transitions and goes on learning from `columns`.
  RegressionReport learn(const Transitions& data, std::vector<Index> columns, std::int64_t epochs,
                         std::uint32_t round, ThreadPool& pool);

  // Fills what is missing in the first n columns of `actions` (within the action's bounds), of the
  // rows where known[i] != 0; `available` becomes 1 there. Needs learn() first.
  void infer(const Transitions& data, Index n, const Vector<float>& known, ThreadPool& pool,
             Matrix<float>& actions, Matrix<float>& available) const;

  void archive(Archive& a) { a("theta", all_of(theta_)); }

 private:
  // The network sees s and s' - s, each in units of its own deviation: the difference is what an
  // action makes.
  Matrix<float> inputs(const Transitions& data, Index n) const;

  Index dim_;
  ActionSpace action_;
  InverseDynamicsSettings settings_;
  double clip_;
  std::uint64_t seed_;
  PolicyNetwork<float> network_;
  Vector<float> theta_;
  Normalizer normalizer_;
  Vector<double> scale_;
};

// Learns from demos.some_action and fills missing entries of `actions` in place (within the
// action's bounds); `available` becomes 1 where an entry is known or was filled. Known entries stay
// as they are. A dimension that no demonstration tells stays missing: there is nothing here to
// infer it from.
RegressionReport infer_missing_actions(const DemoData& demos, const ActionSpace& action,
                                       const InverseDynamicsSettings& settings, double clip,
                                       ThreadPool& pool, std::uint64_t seed, Matrix<float>& actions,
                                       Matrix<float>& available);

}  // namespace agail
