#include "agail/nn/distribution.h"

#include <cmath>
#include <numbers>

namespace agail {

namespace {

template <class S>
using Std = Eigen::Map<const Eigen::Array<S, Eigen::Dynamic, 1>>;

// Column softmax, written to p; returns log sum exp.
template <class Column, class Result>
auto softmax(const Column& logits, Result&& p) {
  const auto largest = logits.maxCoeff();
  p = (logits.array() - largest).exp();
  const auto total = p.sum();
  p /= total;
  return largest + std::log(total);
}

}  // namespace

template <class S>
void ActionDistribution<S>::log_prob(const ConstView<S>& output, const S* log_std,
                                     const ConstView<S>& action, const ConstView<S>* available,
                                     Eigen::Ref<RowVector<S>> result) const {
  const auto half_log_2pi = static_cast<S>(0.5 * std::log(2 * std::numbers::pi));
  for (Index j = 0; j < output.cols(); ++j) {
    S sum = 0;
    if (discrete_) {
      const S largest = output.col(j).maxCoeff();
      const S total = (output.col(j).array() - largest).exp().sum();
      sum = output(static_cast<Index>(action(0, j)), j) - largest - std::log(total);
      if (available != nullptr && (*available)(0, j) == S(0)) sum = 0;
    } else {
      for (Index i = 0; i < size_; ++i) {
        if (available != nullptr && (*available)(i, j) == S(0)) continue;
        const S z = (action(i, j) - output(i, j)) * std::exp(-log_std[i]);
        sum -= S(0.5) * z * z + log_std[i] + half_log_2pi;
      }
    }
    result[j] = sum;
  }
}

template <class S>
void ActionDistribution<S>::score(const ConstView<S>& output, const S* log_std,
                                  const ConstView<S>& action, const ConstView<S>* available,
                                  const Eigen::Ref<const RowVector<S>>& weight, View<S> d_output,
                                  S* d_log_std) const {
  for (Index j = 0; j < output.cols(); ++j) {
    if (discrete_) {
      // d log p(a) / d logits = onehot(a) - p
      auto d = d_output.col(j).array();
      if (available != nullptr && (*available)(0, j) == S(0)) {
        d.setZero();
        continue;
      }
      softmax(output.col(j), d);
      d *= -weight[j];
      d[static_cast<Index>(action(0, j))] += weight[j];
    } else {
      // d log p / d mean = z / std,  d log p / d log_std = z^2 - 1
      for (Index i = 0; i < size_; ++i) {
        if (available != nullptr && (*available)(i, j) == S(0)) {
          d_output(i, j) = 0;
          continue;
        }
        const S inverse_std = std::exp(-log_std[i]);
        const S z = (action(i, j) - output(i, j)) * inverse_std;
        d_output(i, j) = weight[j] * z * inverse_std;
        d_log_std[i] += weight[j] * (z * z - S(1));
      }
    }
  }
}

template <class S>
void ActionDistribution<S>::kl(const ConstView<S>& old_output, const S* old_log_std,
                               const ConstView<S>& output, const S* log_std,
                               Eigen::Ref<RowVector<S>> result) const {
  for (Index j = 0; j < output.cols(); ++j) {
    S sum = 0;
    if (discrete_) {
      const S old_largest = old_output.col(j).maxCoeff();
      const S largest = output.col(j).maxCoeff();
      const S old_total = (old_output.col(j).array() - old_largest).exp().sum();
      const S total = (output.col(j).array() - largest).exp().sum();
      for (Index i = 0; i < size_; ++i) {
        const S old_log_p = old_output(i, j) - old_largest - std::log(old_total);
        const S log_p = output(i, j) - largest - std::log(total);
        sum += std::exp(old_log_p) * (old_log_p - log_p);
      }
    } else {
      // log(s1/s0) + (s0^2 + (m0 - m1)^2) / (2 s1^2) - 1/2
      for (Index i = 0; i < size_; ++i) {
        const S difference = old_output(i, j) - output(i, j);
        const S inverse_variance = std::exp(S(-2) * log_std[i]);
        sum +=
            log_std[i] - old_log_std[i] - S(0.5) +
            S(0.5) * (std::exp(S(2) * old_log_std[i]) + difference * difference) * inverse_variance;
      }
    }
    result[j] = sum;
  }
}

template <class S>
double ActionDistribution<S>::entropy(const ConstView<S>& output, const S* log_std) const {
  double sum = 0;
  if (!discrete_) {
    for (Index i = 0; i < size_; ++i)
      sum +=
          static_cast<double>(log_std[i]) + 0.5 * std::log(2 * std::numbers::pi * std::numbers::e);
    return sum * static_cast<double>(output.cols());
  }
  for (Index j = 0; j < output.cols(); ++j) {
    const S largest = output.col(j).maxCoeff();
    const S log_total = std::log((output.col(j).array() - largest).exp().sum());
    for (Index i = 0; i < size_; ++i) {
      const S log_p = output(i, j) - largest - log_total;
      sum -= static_cast<double>(std::exp(log_p) * log_p);
    }
  }
  return sum;
}

template <class S>
void ActionDistribution<S>::add_entropy_gradient(const ConstView<S>& output, S weight,
                                                 View<S> d_output, S* d_log_std) const {
  for (Index j = 0; j < output.cols(); ++j) {
    if (!discrete_) {
      for (Index i = 0; i < size_; ++i) d_log_std[i] += weight;
      continue;
    }
    // d H / d logit_i = -p_i (log p_i + H)
    const S largest = output.col(j).maxCoeff();
    const S log_total = std::log((output.col(j).array() - largest).exp().sum());
    S h = 0;
    for (Index i = 0; i < size_; ++i) {
      const S log_p = output(i, j) - largest - log_total;
      h -= std::exp(log_p) * log_p;
    }
    for (Index i = 0; i < size_; ++i) {
      const S log_p = output(i, j) - largest - log_total;
      d_output(i, j) -= weight * std::exp(log_p) * (log_p + h);
    }
  }
}

template <class S>
void ActionDistribution<S>::multiply_by_fisher(const ConstView<S>& output, const S* log_std,
                                               View<S> tangent) const {
  for (Index j = 0; j < output.cols(); ++j) {
    if (discrete_) {
      const S largest = output.col(j).maxCoeff();
      const S total = (output.col(j).array() - largest).exp().sum();
      const auto p = (output.col(j).array() - largest).exp() / total;
      const S mean = (p * tangent.col(j).array()).sum();
      tangent.col(j).array() = p * (tangent.col(j).array() - mean);
    } else {
      tangent.col(j).array() *= (S(-2) * Std<S>(log_std, size_)).exp();
    }
  }
}

template <class S>
void ActionDistribution<S>::sample(const S* output, const S* log_std, RandomStream& random,
                                   S* action) const {
  if (!discrete_) {
    for (Index i = 0; i < size_; ++i)
      action[i] = output[i] + std::exp(log_std[i]) * static_cast<S>(random.normal());
    return;
  }
  // Gumbel-max: argmax_i logit_i + g_i is distributed as softmax(logits).
  S best = 0;
  for (Index i = 0; i < size_; ++i) {
    const S value = output[i] - static_cast<S>(std::log(-std::log1p(-random.uniform()) + 1e-300));
    if (i == 0 || value > best) {
      best = value;
      action[0] = static_cast<S>(i);
    }
  }
}

template <class S>
void ActionDistribution<S>::mode(const S* output, S* action) const {
  const Eigen::Map<const Vector<S>> o(output, size_);
  if (!discrete_) {
    Eigen::Map<Vector<S>>(action, size_) = o;
    return;
  }
  Index best = 0;
  o.maxCoeff(&best);
  action[0] = static_cast<S>(best);
}

template class ActionDistribution<float>;
template class ActionDistribution<double>;

}  // namespace agail
