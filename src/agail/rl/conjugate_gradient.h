// Solves A x = b for a symmetric positive A that is only known by its products (Hestenes & Stiefel,
// 1952).
#pragma once

#include "agail/nn/matrix.h"

namespace agail {

template <class S>
class ConjugateGradient {
 public:
  explicit ConjugateGradient(Index size)
      : x_(Vector<S>::Zero(size)), residual_(x_), direction_(x_), product_(x_) {}

  // multiply(v, result) computes A v. Stops after `iterations`, or when |residual|^2 < 1e-10.
  template <class Multiply>
  const Vector<S>& solve(Multiply&& multiply, const Vector<S>& b, int iterations) {
    x_.setZero();
    residual_ = b;
    direction_ = b;
    double squared = dot(residual_, residual_);
    for (int i = 0; i < iterations && squared >= 1e-10; ++i) {
      multiply(direction_, product_);
      const double step = squared / dot(direction_, product_);
      x_ += static_cast<S>(step) * direction_;
      residual_ -= static_cast<S>(step) * product_;
      const double next = dot(residual_, residual_);
      direction_ = residual_ + static_cast<S>(next / squared) * direction_;
      squared = next;
    }
    return x_;
  }

  // x^T A x of the last solution x, without another product: A x = b - residual.
  double curvature(const Vector<S>& b) const { return dot(x_, b) - dot(x_, residual_); }

  // In double precision, so that float parameters do not lose the small components of a long
  // vector.
  static double dot(const Vector<S>& a, const Vector<S>& b) {
    return a.template cast<double>().dot(b.template cast<double>());
  }

 private:
  Vector<S> x_, residual_, direction_, product_;
};

}  // namespace agail
