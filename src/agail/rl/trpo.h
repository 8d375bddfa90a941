// Trust Region Policy Optimization (Schulman et al., 2015): one natural-gradient step within a KL
// ball.
#pragma once

#include "agail/base/stopwatch.h"
#include "agail/config/settings.h"
#include "agail/rl/conjugate_gradient.h"
#include "agail/rl/policy_objective.h"

namespace agail {

// A further term of the policy's objective, such as cloning; evaluated at parameters near the old
// ones.
class AuxiliaryTerm {
 public:
  virtual ~AuxiliaryTerm() = default;
  // Draws the samples of this update. theta: the old parameters.
  virtual void begin_update(const Vector<float>& theta) = 0;
  virtual double value(const Vector<float>& theta) = 0;
  virtual void add_gradient(const Vector<float>& theta, Vector<float>& gradient) = 0;
};

struct TrpoReport {
  double kl = 0;
  double entropy = 0;      // of the new policy, mean over the batch
  double improvement = 0;  // of the whole objective
  double gradient_norm = 0;
  int halvings = 0;  // of the line search
  bool accepted = false;
};

class Trpo {
 public:
  Trpo(const PolicyNetwork<float>& network, Team team, const TrpoSettings& settings,
       Index capacity);

  // One step of theta on a batch of n samples; see PolicyObjective::bind for shapes. `auxiliary`
  // may be null.
  TrpoReport update(Vector<float>& theta, const Matrix<float>& x, const Matrix<float>& actions,
                    const Vector<float>& advantages, Index n, AuxiliaryTerm* auxiliary,
                    Stopwatch& stopwatch);

 private:
  TrpoSettings settings_;
  PolicyObjective<float> objective_;
  ConjugateGradient<float> solver_;
  Vector<float> gradient_, step_, old_, candidate_;
};

}  // namespace agail
