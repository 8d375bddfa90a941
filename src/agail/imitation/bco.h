// Behaviour cloning from observation (Torabi et al., IJCAI 2018, Algorithm 1 with alpha > 0): the
// policy's own transitions tell what actions do, inverse dynamics infers the demonstrated ones that
// are missing, the policy is cloned from all, collects again, and so on. Demonstrated actions that
// are available are learned from as well, and kept.
#pragma once

#include <optional>

#include "agail/imitation/behavior_cloning.h"
#include "agail/imitation/inverse_dynamics.h"
#include "agail/rl/rollout.h"

namespace agail {

// What the two fits of a round were worth, on steps that this round held out. Rounds draw them
// anew, and a fit goes on from the last one's, so from the second round on they are no strangers.
struct BcoReport {
  RegressionReport inverse_dynamics, cloning;
};

class BehaviorCloningFromObservation {
 public:
  BehaviorCloningFromObservation(const PolicyNetwork<float>& network, const Normalizer& normalizer,
                                 const DemoData& demos, const ActionSpace& action,
                                 const Settings& settings, ThreadPool& pool, std::uint64_t seed);

  // Keeps the batch's transitions. At the end of a round fits inverse dynamics, fills in `targets`
  // and fits theta to them, networks from where they are; continuous actions explore with
  // start.log_std from then on. `update` numbers the batches from 0.
  std::optional<BcoReport> update(const Batch& batch, std::uint32_t update, Vector<float>& theta,
                                  CloningTargets& targets);

  void archive(Archive& a);

 private:
  void keep(const Batch& batch);
  RegressionReport learn_inverse_dynamics(std::uint32_t round, CloningTargets& targets);

  const PolicyNetwork<float>& network_;
  const Normalizer& normalizer_;
  const DemoData& demos_;
  ActionSpace action_;
  Settings settings_;
  ThreadPool& pool_;
  std::uint64_t seed_;
  InverseDynamics inverse_dynamics_;
  // Own transitions, a ring, one a column.
  Matrix<float> states_, next_states_, actions_;
  std::int64_t kept_ = 0;  // so far, of which the ring holds the latest
};

}  // namespace agail
