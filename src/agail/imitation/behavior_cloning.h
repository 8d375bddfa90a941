// Behaviour cloning (Pomerleau, 1991): the policy's network fitted to demonstrated actions; as a
// method of its own, as the start of others, and as a term of their objective.
#pragma once

#include "agail/imitation/action_regression.h"
#include "agail/imitation/demo_data.h"
#include "agail/nn/normalizer.h"
#include "agail/rl/trpo.h"

namespace agail {

// Actions to clone: those of the file, or with the missing ones inferred.
struct CloningTargets {
  Matrix<float> actions;       // action_dim x n
  Matrix<float> available;     // action_dim x n
  std::vector<Index> columns;  // with at least one available entry
};

// Fits theta's network part; the normaliser (of the demonstrated states) is given. Where
// `fit_log_std` is set, log_std becomes that of the residuals (the maximum-likelihood value, at
// least -3). `round` numbers fits that go on from each other.
RegressionReport clone_policy(const PolicyNetwork<float>& network, const Normalizer& normalizer,
                              const DemoData& demos, const CloningTargets& targets,
                              const BcSettings& settings, bool fit_log_std, ThreadPool& pool,
                              std::uint64_t seed, Vector<float>& theta, std::uint32_t round = 0);

// weight_k * mean_j log pi(a_j | s_j) over demonstrated pairs, weight_k = weight * decay^k at
// update k.
class CloningTerm : public AuxiliaryTerm {
 public:
  // Network, normaliser, demonstrations and targets stay with the caller, and may change in
  // between.
  CloningTerm(const PolicyNetwork<float>& network, const Normalizer& normalizer,
              const DemoData& demos, const CloningTargets& targets, const CloneSettings& settings,
              ThreadPool& pool, std::uint64_t seed);

  void begin_update(const Vector<float>& theta) override;
  double value(const Vector<float>& theta) override;
  void add_gradient(const Vector<float>& theta, Vector<float>& gradient) override;
  // Value of the mean log-likelihood at the last begin_update.
  double log_likelihood() const { return log_likelihood_; }
  void archive(Archive& a) { a("update", update_); }

 private:
  double total_log_likelihood(const Vector<float>& theta);  // of the minibatch

  const PolicyNetwork<float>& network_;
  const Normalizer& normalizer_;
  const DemoData& demos_;
  const CloningTargets& targets_;
  CloneSettings settings_;
  ThreadPool& pool_;
  std::uint64_t seed_;
  std::int64_t update_ = 0;
  double weight_ = 0, log_likelihood_ = 0;
  Matrix<float> x_, actions_, available_;
  ChunkSums<float> sums_;
  ChunkSums<double> scalar_sums_;
  struct Worker {
    Scratch<float> scratch;
    RowVector<float> row;
  };
  std::vector<Worker> workers_;
};

}  // namespace agail
