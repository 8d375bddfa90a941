#include "agail/rl/trpo.h"

#include <cmath>

namespace agail {

namespace {
// The quadratic model of the KL is not exact; a step a little outside the ball is still taken
// (OpenAI Baselines), otherwise every other step is halved and the policy moves at a quarter of the
// KL that was asked for.
constexpr double kKlTolerance = 1.5;
}  // namespace

Trpo::Trpo(const PolicyNetwork<float>& network, Team team, const TrpoSettings& settings,
           Index capacity)
    : settings_(settings),
      objective_(network, team, capacity, static_cast<int>(settings.fisher_stride)),
      solver_(network.parameters()),
      gradient_(Vector<float>::Zero(network.parameters())),
      step_(gradient_),
      old_(gradient_),
      candidate_(gradient_) {}

TrpoReport Trpo::update(Vector<float>& theta, const Matrix<float>& x, const Matrix<float>& actions,
                        const Vector<float>& advantages, Index n, AuxiliaryTerm* auxiliary,
                        Stopwatch& stopwatch) {
  TrpoReport report;
  stopwatch.start(Phase::kPolicyGradient);
  old_ = theta;
  objective_.bind(old_, x, actions, advantages, n, static_cast<float>(settings_.entropy_weight));
  gradient_ = objective_.gradient();
  if (auxiliary != nullptr) {
    auxiliary->begin_update(old_);
    auxiliary->add_gradient(old_, gradient_);
  }
  report.gradient_norm = std::sqrt(solver_.dot(gradient_, gradient_));

  // s = (F + damping I)^-1 g
  stopwatch.start(Phase::kConjugateGradient);
  const auto damping = static_cast<float>(settings_.cg_damping);
  const auto multiply = [&](const Vector<float>& v, Vector<float>& result) {
    objective_.fisher_vector_product(v, result);
    result += damping * v;
  };
  step_ = solver_.solve(multiply, gradient_, static_cast<int>(settings_.cg_iterations));
  const double curvature = solver_.curvature(gradient_);

  stopwatch.start(Phase::kLineSearch);
  const auto whole = [&](const Vector<float>& parameters, double surrogate) {
    return auxiliary == nullptr ? surrogate : surrogate + auxiliary->value(parameters);
  };
  const PolicyObjective<float>::Value before = objective_.evaluate_old();
  const double start = whole(old_, before.surrogate);
  report.entropy = before.entropy;
  if (std::isfinite(curvature) && curvature > 0) {
    // The longest step s with s^T (F + damping I) s / 2 = max_kl, halved until the KL is kept and
    // the objective improves.
    double scale = std::sqrt(2 * settings_.max_kl / curvature);
    for (int i = 0; i < settings_.line_search_halvings; ++i, scale /= 2) {
      candidate_ = old_ + static_cast<float>(scale) * step_;
      const PolicyObjective<float>::Value value = objective_.evaluate(candidate_);
      const double improvement = whole(candidate_, value.surrogate) - start;
      report.halvings = i;
      if (std::isfinite(value.kl) && value.kl <= kKlTolerance * settings_.max_kl &&
          improvement > 0) {
        theta = candidate_;
        report.kl = value.kl;
        report.entropy = value.entropy;
        report.improvement = improvement;
        report.accepted = true;
        break;
      }
    }
  }
  stopwatch.start(Phase::kRest);
  return report;
}

}  // namespace agail
