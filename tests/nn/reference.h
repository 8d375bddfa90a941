// What the learning code should compute, written as plainly as it can be: loops over numbers, no
// Eigen products, and derivatives by dual numbers (v + d e with e^2 = 0), which are exact to
// rounding and share nothing with the formulas under test.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "agail/base/random.h"
#include "agail/nn/mlp.h"

namespace agail::reference {

template <class T>
struct Dual {
  T v{}, d{};
  Dual() = default;
  Dual(double value) : v(value), d(0.0) {}  // NOLINT: numbers are duals
  Dual(T value, T derivative) : v(value), d(derivative) {}
};

inline double number(double x) { return x; }
template <class T>
double number(const Dual<T>& x) {
  return number(x.v);
}

template <class T>
Dual<T> operator+(const Dual<T>& a, const Dual<T>& b) {
  return {a.v + b.v, a.d + b.d};
}
template <class T>
Dual<T> operator-(const Dual<T>& a, const Dual<T>& b) {
  return {a.v - b.v, a.d - b.d};
}
template <class T>
Dual<T> operator*(const Dual<T>& a, const Dual<T>& b) {
  return {a.v * b.v, a.v * b.d + a.d * b.v};
}
template <class T>
Dual<T> operator/(const Dual<T>& a, const Dual<T>& b) {
  return {a.v / b.v, (a.d * b.v - a.v * b.d) / (b.v * b.v)};
}

inline double exponential(double x) { return std::exp(x); }
inline double logarithm(double x) { return std::log(x); }
inline double root(double x) { return std::sqrt(x); }
inline double hyperbolic_tangent(double x) { return std::tanh(x); }
template <class T>
Dual<T> exponential(const Dual<T>& x) {
  const T e = exponential(x.v);
  return {e, e * x.d};
}
template <class T>
Dual<T> logarithm(const Dual<T>& x) {
  return {logarithm(x.v), x.d / x.v};
}
template <class T>
Dual<T> root(const Dual<T>& x) {
  const T r = root(x.v);
  return {r, x.d / (r + r)};
}
template <class T>
Dual<T> hyperbolic_tangent(const Dual<T>& x) {
  const T t = hyperbolic_tangent(x.v);
  return {t, (T(1.0) - t * t) * x.d};
}

template <class T>
using Numbers = std::vector<T>;

// W_l (out x in, column-major), then b_l, for each layer.
template <class T>
Numbers<T> mlp(const std::vector<int>& sizes, Activation activation, const T* theta,
               const Numbers<T>& x) {
  Numbers<T> h = x;
  for (std::size_t l = 0; l + 1 < sizes.size(); ++l) {
    const auto in = static_cast<std::size_t>(sizes[l]);
    const auto out = static_cast<std::size_t>(sizes[l + 1]);
    Numbers<T> z(out, T(0.0));
    for (std::size_t i = 0; i < out; ++i) {
      for (std::size_t j = 0; j < in; ++j) z[i] = z[i] + theta[j * out + i] * h[j];
      z[i] = z[i] + theta[in * out + i];
      if (l + 2 == sizes.size()) continue;
      if (activation == Activation::kTanh)
        z[i] = hyperbolic_tangent(z[i]);
      else if (number(z[i]) < 0)
        z[i] = T(0.01) * z[i];
    }
    theta += (in + 1) * out;
    h = z;
  }
  return h;
}

// |d output / dx| of a network with one output.
template <class T>
T input_gradient_norm(const std::vector<int>& sizes, Activation activation, const T* theta,
                      const Numbers<double>& x) {
  std::size_t parameters = 0;
  for (std::size_t l = 0; l + 1 < sizes.size(); ++l)
    parameters += static_cast<std::size_t>((sizes[l] + 1) * sizes[l + 1]);
  Numbers<Dual<T>> fixed;
  for (std::size_t k = 0; k < parameters; ++k) fixed.push_back({theta[k], T(0.0)});
  T squares(0.0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    Numbers<Dual<T>> moved;
    for (std::size_t j = 0; j < x.size(); ++j) moved.push_back({T(x[j]), T(i == j ? 1.0 : 0.0)});
    const T slope = mlp(sizes, activation, fixed.data(), moved)[0].d;
    squares = squares + slope * slope;
  }
  return root(squares);
}

template <class T>
T log_sum_exp(const Numbers<T>& x) {
  T sum(0.0);
  for (const T& value : x) sum = sum + exponential(value);
  return logarithm(sum);
}

// Entries without `available` do not count.
template <class T>
T log_prob(bool discrete, const Numbers<T>& output, const T* log_std, const Numbers<double>& action,
           const Numbers<double>& available) {
  T sum(0.0);
  if (discrete) {
    if (available[0] == 0) return sum;
    return output[static_cast<std::size_t>(action[0])] - log_sum_exp(output);
  }
  for (std::size_t i = 0; i < output.size(); ++i) {
    if (available[i] == 0) continue;
    const T z = (T(action[i]) - output[i]) / exponential(log_std[i]);
    sum = sum - T(0.5) * z * z - log_std[i] - T(0.5 * std::log(2 * std::numbers::pi));
  }
  return sum;
}

template <class T>
T entropy(bool discrete, const Numbers<T>& output, const T* log_std) {
  T sum(0.0);
  for (std::size_t i = 0; i < output.size(); ++i) {
    if (discrete) {
      const T log_p = output[i] - log_sum_exp(output);
      sum = sum - exponential(log_p) * log_p;
    } else {
      sum = sum + log_std[i] + T(0.5 * std::log(2 * std::numbers::pi * std::numbers::e));
    }
  }
  return sum;
}

// KL(old || fresh), the old one a constant.
template <class T>
T kl(bool discrete, const Numbers<double>& old_output, const double* old_log_std,
     const Numbers<T>& output, const T* log_std) {
  T sum(0.0);
  for (std::size_t i = 0; i < output.size(); ++i) {
    if (discrete) {
      const double old_log_p = old_output[i] - log_sum_exp(old_output);
      sum = sum + T(std::exp(old_log_p)) * (T(old_log_p) - output[i] + log_sum_exp(output));
    } else {
      const T difference = T(old_output[i]) - output[i];
      sum = sum + log_std[i] - T(old_log_std[i]) - T(0.5) +
            (T(std::exp(2 * old_log_std[i])) + difference * difference) /
                (T(2.0) * exponential(T(2.0) * log_std[i]));
    }
  }
  return sum;
}

// df/dx_k for all k, f(Numbers<Dual<double>>) -> Dual<double>.
template <class F>
Vector<double> gradient(F&& f, const Vector<double>& x) {
  Numbers<Dual<double>> at(x.begin(), x.end());
  Vector<double> result(x.size());
  for (std::size_t k = 0; k < at.size(); ++k) {
    at[k].d = 1;
    result[static_cast<Index>(k)] = f(at).d;
    at[k].d = 0;
  }
  return result;
}

// H v of f(Numbers<Dual<Dual<double>>>).
template <class F>
Vector<double> hessian_vector_product(F&& f, const Vector<double>& x, const Vector<double>& v) {
  using Inner = Dual<double>;
  Numbers<Dual<Inner>> at;
  for (Index k = 0; k < x.size(); ++k) at.push_back({Inner(x[k], v[k]), Inner(0.0)});
  Vector<double> result(x.size());
  for (std::size_t k = 0; k < at.size(); ++k) {
    at[k].d = Inner(1.0);
    result[static_cast<Index>(k)] = f(at).d.d;
    at[k].d = Inner(0.0);
  }
  return result;
}

// Central differences of f(Vector<double>) -> double.
template <class F>
Vector<double> differences(F&& f, Vector<double> x, double h = 1e-5) {
  Vector<double> result(x.size());
  for (Index k = 0; k < x.size(); ++k) {
    const double here = x[k];
    x[k] = here + h;
    const double above = f(x);
    x[k] = here - h;
    const double below = f(x);
    x[k] = here;
    result[k] = (above - below) / (2 * h);
  }
  return result;
}

// |a - b| / |b|, where b must not vanish.
template <class A, class B>
double relative_error(const A& a, const B& b) {
  EXPECT_GT(b.norm(), 1e-8);
  return (a - b).norm() / b.norm();
}

template <class Column>
Numbers<double> numbers(const Column& column) {
  Numbers<double> result;
  for (Index i = 0; i < column.size(); ++i) result.push_back(static_cast<double>(column(i)));
  return result;
}

template <class T>
Numbers<T> convert(const Numbers<double>& x) {
  return Numbers<T>(x.begin(), x.end());
}

inline Matrix<double> normal_matrix(Index rows, Index columns, std::uint64_t seed,
                                    double scale = 1) {
  RandomStream random(seed, Purpose::kDiagnostics);
  Matrix<double> x(rows, columns);
  for (Index j = 0; j < columns; ++j)
    for (Index i = 0; i < rows; ++i) x(i, j) = scale * random.normal();
  return x;
}

inline Vector<double> normal_vector(Index size, std::uint64_t seed, double scale = 1) {
  return normal_matrix(size, 1, seed, scale).col(0);
}

// Network inputs: normal, last row ones.
inline Matrix<double> network_input(Index inputs, Index columns, std::uint64_t seed) {
  Matrix<double> x = normal_matrix(inputs + 1, columns, seed);
  x.row(inputs).setOnes();
  return x;
}

template <class T>
bool same_bits(const T& a, const T& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(),
                     static_cast<std::size_t>(a.size()) * sizeof(a.data()[0])) == 0;
}

}  // namespace agail::reference
