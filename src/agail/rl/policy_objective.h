// What TRPO asks of the policy at the parameters that collected a batch: the surrogate's gradient,
// Fisher-vector products, and surrogate and KL at other parameters. Schulman et al., "Trust Region
// Policy Optimization", 2015:
//
//   L(theta)  = mean_j pi_theta(a_j|s_j) / pi_old(a_j|s_j) A_j + w mean_j H(pi_theta(.|s_j))
//
//   F         = mean_j J_j^T M_j J_j
//
//   KL(theta) = mean_j KL(pi_old(.|s_j) || pi_theta(.|s_j))
//
// (equation 14 and appendix C; J is the Jacobian of the network's outputs, M their Fisher matrix.)
#pragma once

#include "agail/nn/chunks.h"
#include "agail/rl/policy_network.h"

namespace agail {

template <class S>
class PolicyObjective {
 public:
  // For batches of up to `capacity` samples; the Fisher matrix uses every `fisher_stride`-th.
  PolicyObjective(const PolicyNetwork<S>& network, Team team, Index capacity, int fisher_stride);

  // Fixes theta_old and the batch, and computes the gradient there. x: (observations + 1) x >= n
  // with a last row of ones; actions: as sampled; advantages: n. All must outlive the use of this
  // object until the next bind.
  void bind(const Vector<S>& theta_old, const Matrix<S>& x, const Matrix<S>& actions,
            const Vector<S>& advantages, Index n, S entropy_weight);

  // dL/dtheta at theta_old.
  const Vector<S>& gradient() const { return gradient_; }
  // F v.
  void fisher_vector_product(const Vector<S>& v, Vector<S>& result);

  struct Value {
    double surrogate = 0;  // L, entropy term included
    double kl = 0;
    double entropy = 0;
  };
  Value evaluate(const Vector<S>& theta);
  // The same at theta_old, where every ratio is 1: from what bind() kept.
  Value evaluate_old();

 private:
  void compute_gradient();
  // Of the batch's sums of surrogate, KL and entropy.
  Value mean(const Eigen::Map<Vector<double>>& total) const;

  const PolicyNetwork<S>& network_;
  Team team_;
  int fisher_stride_;
  Index n_ = 0, fisher_n_ = 0;
  S entropy_weight_ = 0;
  const Matrix<S>* x_ = nullptr;
  const Matrix<S>* actions_ = nullptr;
  const Vector<S>* advantages_ = nullptr;
  Vector<S> theta_old_;
  Matrix<S> old_output_;
  Tape<S> fisher_tape_;
  Matrix<S> fisher_x_;
  RowVector<S> old_log_prob_;
  ChunkSums<S> parameter_sums_;
  ChunkSums<double> scalar_sums_;
  Vector<S> gradient_;
  struct Worker {
    Scratch<S> scratch;
    Matrix<S> adjoint;
    RowVector<S> row;
  };
  std::vector<Worker> workers_;
};

extern template class PolicyObjective<float>;
extern template class PolicyObjective<double>;

}  // namespace agail
