// Adversarial imitation from incomplete demonstrations (Sun & Ma, IJCAI 2019, Algorithm 1), and
// what it becomes with parts left out: without the guide state-GAIL, without the guide and with
// actions in the discriminator GAIL.
#pragma once

#include <memory>
#include <optional>

#include "agail/imitation/discriminator.h"
#include "agail/imitation/guide.h"
#include "agail/rl/rollout.h"

namespace agail {

// What the last update learned and paid; the reports are absent where a part does not exist or did
// not learn on this batch.
struct ImitationReport {
  std::optional<DiscriminatorReport> discriminator;
  std::optional<GuideReport> guide;
  double discriminator_reward = 0;  // mean r_D over the batch
  bool has_guide = false;
  double guide_reward = 0;  // mean r_Q, before beta
};

class AdversarialReward {
 public:
  // method: agail | state-gail | gail. Throws InputError if gail finds no complete step.
  AdversarialReward(const std::string& method, const DemoData& demos, const ActionSpace& action,
                    double missing_ratio, const Settings& settings, Team team, Index capacity,
                    std::uint64_t seed);

  // One update of Algorithm 1, up to the policy's step. `update` numbers the batches. Fills
  // rewards[0, n).
  ImitationReport update(const Batch& batch, const PolicyView& policy, std::uint32_t update,
                         Vector<float>& rewards, Stopwatch& stopwatch);

  double beta() const { return beta_; }
  bool has_guide() const { return guide_ != nullptr; }
  void archive(Archive& a);

 private:
  const DemoData& demos_;
  ActionSpace action_;
  Settings settings_;
  double beta_;
  std::vector<Index> demo_columns_;  // that the discriminator may see
  Discriminator discriminator_;
  std::unique_ptr<Guide> guide_;  // null: no available action, or beta = 0
  Matrix<float> executed_;
  Vector<float> guide_rewards_;
  double running_mean_ = 0, running_count_ = 0;
};

}  // namespace agail
