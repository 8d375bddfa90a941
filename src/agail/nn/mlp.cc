#include "agail/nn/mlp.h"

#include <algorithm>
#include <cmath>

#include "agail/base/error.h"
#include "agail/nn/product.h"

namespace agail {

namespace {
constexpr double kLeak = 0.01;
}

template <class S>
Mlp<S>::Mlp(std::vector<int> sizes, Activation activation)
    : sizes_(std::move(sizes)), activation_(activation) {
  AGAIL_CHECK(sizes_.size() >= 2);
  for (Index l = 0; l < layers(); ++l) {
    offsets_.push_back(parameters_);
    parameters_ += out(l) * (in(l) + 1);
  }
}

template <class S>
Tape<S> Mlp<S>::make_tape(Index samples) const {
  Tape<S> tape;
  for (Index l = 0; l < layers(); ++l)
    tape.outputs.push_back(Matrix<S>::Zero(padded(out(l) + (last(l) ? 0 : 1)), samples));
  return tape;
}

template <class S>
Scratch<S> Mlp<S>::make_scratch() const {
  const Index rows = padded(*std::max_element(sizes_.begin(), sizes_.end()) + 1);
  const Matrix<S> zero = Matrix<S>::Zero(rows, kChunk);
  const std::vector<Matrix<S>> hidden(static_cast<std::size_t>(layers()) - 1, zero);
  return {zero, zero, zero, zero, zero, hidden, hidden, make_tape(kChunk)};
}

template <class S>
void Mlp<S>::initialise(S* theta, RandomStream& random, double output_scale) const {
  for (Index l = 0; l < layers(); ++l) {
    Weights w = weights(theta, l);
    const double bound =
        std::sqrt(3.0 / static_cast<double>(in(l))) * (last(l) ? output_scale : 1.0);
    for (Index column = 0; column < in(l); ++column)
      for (Index row = 0; row < out(l); ++row)
        w(row, column) = static_cast<S>(random.uniform(-bound, bound));
    w.col(in(l)).setZero();
  }
}

template <class S>
ConstView<S> Mlp<S>::input(const ConstView<S>& x, const Tape<S>& tape, Index layer, Index first,
                           Index n) const {
  if (layer == 0) return x;
  return tape.outputs[static_cast<std::size_t>(layer) - 1].block(0, first, in(layer) + 1, n);
}

template <class S>
void Mlp<S>::multiply_by_slope(Matrix<S>& delta, const Tape<S>& tape, Index layer, Index first,
                               Index n) const {
  const Matrix<S>& outputs = tape.outputs[static_cast<std::size_t>(layer)];
  // Whole padded columns, whose further rows nobody reads.
  using Column = Eigen::Array<S, Eigen::Dynamic, 1>;
  for (Index j = 0; j < n; ++j) {
    const Eigen::Map<const Column, Eigen::Aligned64> h(outputs.col(first + j).data(),
                                                       outputs.rows());
    Eigen::Map<Column, Eigen::Aligned64> d(delta.col(j).data(), outputs.rows());
    if (activation_ == Activation::kTanh)
      d *= S(1) - h.square();
    else
      d *= (h > S(0)).template cast<S>() * static_cast<S>(1 - kLeak) + static_cast<S>(kLeak);
  }
}

template <class S>
void Mlp<S>::forward(const S* theta, const ConstView<S>& x, Tape<S>& tape, Index first) const {
  const Index n = x.cols();
  for (Index l = 0; l < layers(); ++l) {
    Matrix<S>& outputs = tape.outputs[static_cast<std::size_t>(l)];
    auto z = outputs.block(0, first, out(l), n);
    multiply<S>(weights(theta, l), input(x, tape, l, first, n), z);
    if (last(l)) break;
    const auto activate = [&](auto h) {
      if (activation_ == Activation::kTanh)
        h = h.tanh();
      else
        h = h.max(static_cast<S>(kLeak) * h);
    };
    // Whole padded columns: rows past the bias row hold zero, and f(0) = 0.
    for (Index j = first; j < first + n; ++j) {
      S* h = outputs.col(j).data();
      if (n == 1) {
        constexpr int kNarrow = kNarrowBytes / sizeof(S);
        for (Index i = 0; i < outputs.rows(); i += kNarrow)
          activate(Eigen::Map<Eigen::Array<S, kNarrow, 1>, Eigen::Aligned32>(h + i));
      } else {
        using Column = Eigen::Array<S, Eigen::Dynamic, 1>;
        activate(Eigen::Map<Column, Eigen::Aligned64>(h, outputs.rows()));
      }
      h[out(l)] = S(1);
    }
  }
}

template <class S>
void Mlp<S>::backward(const S* theta, const ConstView<S>& x, const Tape<S>& tape, Index first,
                      const ConstView<S>& adjoint, S* gradient, Scratch<S>& scratch,
                      View<S>* input_adjoint) const {
  const Index n = x.cols();
  Matrix<S>* delta = &scratch.a;
  Matrix<S>* below = &scratch.b;
  delta->block(0, 0, outputs(), n) = adjoint;
  for (Index l = layers() - 1; l >= 0; --l) {
    const auto d = delta->block(0, 0, out(l), n);
    multiply_by_transposed<S>(d, input(x, tape, l, first, n), weights(gradient, l));
    const auto w = weights(theta, l).leftCols(in(l));
    if (l > 0) {
      auto under = below->block(0, 0, in(l), n);
      multiply_transposed<S>(w, d, under);
      multiply_by_slope(*below, tape, l - 1, first, n);
      std::swap(delta, below);
    } else if (input_adjoint != nullptr) {
      multiply_transposed<S>(w, d, *input_adjoint);
    }
  }
}

template <class S>
void Mlp<S>::tangent(const S* theta, const S* v, const ConstView<S>& x, const Tape<S>& tape,
                     Index first, Scratch<S>& scratch, View<S> result) const {
  const Index n = x.cols();
  Matrix<S>* below = &scratch.a;
  Matrix<S>* here = &scratch.b;
  for (Index l = 0; l < layers(); ++l) {
    // z'_l = V_l h_{l-1} + W_l h'_{l-1},  h'_l = f'(z_l) z'_l
    auto dz = here->block(0, 0, out(l), n);
    multiply<S>(weights(v, l), input(x, tape, l, first, n), dz);
    if (l > 0)
      multiply<S>(weights(theta, l).leftCols(in(l)), below->block(0, 0, in(l), n), dz, true);
    if (last(l))
      result = dz;
    else
      multiply_by_slope(*here, tape, l, first, n);
    std::swap(below, here);
  }
}

template <class S>
double Mlp<S>::add_gradient_penalty(const S* theta, const ConstView<S>& x, const Tape<S>& tape,
                                    Index first, S weight, S* gradient, Scratch<S>& scratch) const {
  AGAIL_CHECK(outputs() == 1);
  const Index n = x.cols();
  const auto hidden = [&](Index l) {
    return tape.outputs[static_cast<std::size_t>(l)].block(0, first, out(l), n);
  };

  // g = d output / dx.
  Matrix<S>* delta = &scratch.a;
  Matrix<S>* below = &scratch.b;
  delta->block(0, 0, 1, n).setOnes();
  for (Index l = layers() - 1; l >= 0; --l) {
    auto under = below->block(0, 0, in(l), n);
    multiply_transposed<S>(weights(theta, l).leftCols(in(l)), delta->block(0, 0, out(l), n), under);
    if (l > 0) multiply_by_slope(*below, tape, l - 1, first, n);
    std::swap(delta, below);
  }
  // u = d penalty / dg = 2 weight (|g| - 1) g / |g|, from here on a constant.
  auto u = delta->block(0, 0, inputs(), n);
  double penalty = 0;
  for (Index j = 0; j < n; ++j) {
    const S norm = u.col(j).norm();
    penalty += static_cast<double>(weight) * static_cast<double>((norm - S(1)) * (norm - S(1)));
    u.col(j) *= S(2) * weight * (norm - S(1)) / std::max(norm, static_cast<S>(1e-12));
  }

  // d/dtheta of sum <u, g> = the gradient of the output's derivative along u: a forward pass of
  // tangents
  //   s_l = W_l t_{l-1},  t_l = f'(z_l) s_l,  t_0 = u,
  // kept for all layers, then a reverse pass over tangents and values together:
  //   dW_l += s~_l t_{l-1}^T + z~_l h_{l-1}^T
  //   s~_{l-1} = f'(z) t~,  z~_{l-1} = f'(z) h~ + f''(z) s t~   with  t~ = W_l^T s~_l,  h~ = W_l^T
  //   z~_l.
  std::vector<Matrix<S>>& s = scratch.tangents;
  std::vector<Matrix<S>>& t = scratch.tangent_outputs;
  for (Index l = 0; l + 1 < layers(); ++l) {
    const auto i = static_cast<std::size_t>(l);
    auto sl = s[i].block(0, 0, out(l), n);
    const auto w = weights(theta, l).leftCols(in(l));
    if (l == 0)
      multiply<S>(w, u, sl);
    else
      multiply<S>(w, t[i - 1].block(0, 0, in(l), n), sl);
    t[i].block(0, 0, out(l), n) = sl;
    multiply_by_slope(t[i], tape, l, first, n);
  }
  Matrix<S>* s_bar = &scratch.c;
  Matrix<S>* t_bar = below;
  Matrix<S>* z_bar = &scratch.d;
  Matrix<S>* h_bar = &scratch.e;
  s_bar->block(0, 0, 1, n).setOnes();
  z_bar->block(0, 0, 1, n).setZero();
  for (Index l = layers() - 1; l >= 0; --l) {
    const auto sb = s_bar->block(0, 0, out(l), n);
    const auto zb = z_bar->block(0, 0, out(l), n);
    Weights grad = weights(gradient, l);
    if (l == 0)
      multiply_by_transposed<S>(sb, u, grad.leftCols(in(l)), true);
    else
      multiply_by_transposed<S>(sb, t[static_cast<std::size_t>(l) - 1].block(0, 0, in(l), n),
                                grad.leftCols(in(l)), true);
    if (!last(l)) multiply_by_transposed<S>(zb, input(x, tape, l, first, n), grad, true);
    if (l == 0) break;
    const auto w = weights(theta, l).leftCols(in(l));
    auto tb = t_bar->block(0, 0, in(l), n);
    auto hb = h_bar->block(0, 0, in(l), n);
    multiply_transposed<S>(w, sb, tb);
    multiply_transposed<S>(w, zb, hb);
    const auto h = hidden(l - 1);
    multiply_by_slope(*h_bar, tape, l - 1, first, n);
    if (activation_ == Activation::kTanh)  // f'' = -2 h (1 - h^2); zero for the leaky rectifier
      hb.array() -= S(2) * h.array() * (S(1) - h.array().square()) *
                    s[static_cast<std::size_t>(l) - 1].block(0, 0, in(l), n).array() * tb.array();
    multiply_by_slope(*t_bar, tape, l - 1, first, n);
    std::swap(s_bar, t_bar);
    std::swap(z_bar, h_bar);
  }
  return penalty;
}

template class Mlp<float>;
template class Mlp<double>;

}  // namespace agail
