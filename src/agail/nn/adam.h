// Adam (Kingma & Ba, 2015, algorithm 1 with the bias correction folded into the step size, their
// section 2).
#pragma once

#include <cmath>

#include "agail/base/archive.h"
#include "agail/base/thread_pool.h"
#include "agail/nn/matrix.h"

namespace agail {

template <class S>
class Adam {
 public:
  explicit Adam(Index parameters)
      : first_(Vector<S>::Zero(parameters)), second_(Vector<S>::Zero(parameters)) {}

  // theta -= learning rate * m^ / (sqrt(v^) + epsilon)
  void descend(ThreadPool& pool, Eigen::Ref<Vector<S>> theta,
               const Eigen::Ref<const Vector<S>>& gradient, double learning_rate) {
    const Step step = begin_step(learning_rate);
    constexpr Index kBlock = 1024;  // one pass over memory
    pool.run_blocks(theta.size(), kBlock, [&](Index i, Index n) {
      descend(step, theta.segment(i, n), gradient.segment(i, n), i);
    });
  }

  // The same in parts: begin_step() once, then descend() for all parameters, some at a time, those
  // from `first` on.
  struct Step {
    S rate, epsilon;
  };
  Step begin_step(double learning_rate) {
    ++step_;
    const double correction1 = 1 - std::pow(kBeta1, static_cast<double>(step_));
    const double correction2 = std::sqrt(1 - std::pow(kBeta2, static_cast<double>(step_)));
    return {static_cast<S>(learning_rate * correction2 / correction1),
            static_cast<S>(kEpsilon * correction2)};
  }
  void descend(const Step& step, Eigen::Ref<Vector<S>> theta,
               const Eigen::Ref<const Vector<S>>& gradient, Index first) {
    constexpr auto b1 = static_cast<S>(kBeta1);
    constexpr auto b2 = static_cast<S>(kBeta2);
    auto m = first_.segment(first, theta.size()).array();
    auto v = second_.segment(first, theta.size()).array();
    const auto g = gradient.array();
    m = b1 * m + (S(1) - b1) * g;
    v = b2 * v + (S(1) - b2) * g.square();
    theta.array() -= step.rate * m / (v.sqrt() + step.epsilon);
  }

  std::int64_t steps() const { return step_; }

  void archive(Archive& a) requires std::same_as<S, float> {
    a("first_moment", all_of(first_));
    a("second_moment", all_of(second_));
    a("step", step_);
  }

 private:
  static constexpr double kBeta1 = 0.9, kBeta2 = 0.999, kEpsilon = 1e-8;
  Vector<S> first_, second_;
  std::int64_t step_ = 0;
};

}  // namespace agail
