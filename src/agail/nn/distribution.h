// Action distributions: diagonal Gaussian with a state-independent log-std, or categorical.
//
// The network gives `outputs()` numbers a sample (means, or logits); the Gaussian has dim more
// parameters, log_std. All functions work on columns [samples]; log_std is ignored when discrete.
// Actions: dim x n, discrete 1 x n (index).
#pragma once

#include "agail/base/random.h"
#include "agail/base/spaces.h"
#include "agail/nn/matrix.h"

namespace agail {

template <class S>
class ActionDistribution {
 public:
  explicit ActionDistribution(const ActionSpace& space)
      : discrete_(space.discrete), size_(space.encoded_dim()) {}

  bool discrete() const { return discrete_; }
  Index outputs() const { return size_; }
  Index actions() const { return discrete_ ? 1 : size_; }
  Index log_stds() const { return discrete_ ? 0 : size_; }

  // result[j] = log p(action_j). Gaussian: sum over dimensions of -z^2/2 - log_std - log(2 pi)/2, z
  // = (a - mean)/std. `available` (actions() x n of 0/1, or null): only dimensions with 1 are
  // summed.
  void log_prob(const ConstView<S>& output, const S* log_std, const ConstView<S>& action,
                const ConstView<S>* available, Eigen::Ref<RowVector<S>> result) const;

  // Gradient of sum_j weight_j log p(action_j), over available dimensions: d_output (written),
  // d_log_std (added).
  void score(const ConstView<S>& output, const S* log_std, const ConstView<S>& action,
             const ConstView<S>* available, const Eigen::Ref<const RowVector<S>>& weight,
             View<S> d_output, S* d_log_std) const;

  // result[j] = KL(old_j || fresh_j).
  void kl(const ConstView<S>& old_output, const S* old_log_std, const ConstView<S>& output,
          const S* log_std, Eigen::Ref<RowVector<S>> result) const;

  // Sum of the entropies of the columns; gradient times `weight`: *added* to d_output (may be null)
  // and d_log_std.
  double entropy(const ConstView<S>& output, const S* log_std) const;
  void add_entropy_gradient(const ConstView<S>& output, S weight, View<S> d_output,
                            S* d_log_std) const;

  // tangent = M tangent, M the Fisher matrix of the outputs: 1/std^2, or diag(p) - p p^T.
  // (The Fisher matrix of log_std is 2 I a sample.)
  void multiply_by_fisher(const ConstView<S>& output, const S* log_std, View<S> tangent) const;

  // One action from one column. `action`: actions() numbers.
  void sample(const S* output, const S* log_std, RandomStream& random, S* action) const;
  void mode(const S* output, S* action) const;

 private:
  bool discrete_;
  Index size_;
};

extern template class ActionDistribution<float>;
extern template class ActionDistribution<double>;

}  // namespace agail
