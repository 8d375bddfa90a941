// A multilayer perceptron on flat parameters, batched by columns.
//
// Layer l computes z_l = W_l h_{l-1} + b_l; hidden layers h_l = f(z_l); the last layer is linear.
// Inputs and hidden outputs carry a last row of ones, so that [W_l b_l] is one matrix and the bias
// costs nothing. Parameters of a layer: W_l (out x in, column-major), then b_l.
//
// The class holds shapes only. Values that a pass leaves behind for later passes (a Tape) and
// scratch space belong to the caller, who may run different chunks of columns at the same time.
#pragma once

#include <vector>

#include "agail/base/random.h"
#include "agail/nn/matrix.h"

namespace agail {

enum class Activation { kTanh, kLeakyRelu };  // leaky slope: 0.01

// {in, hidden..., out}
inline std::vector<int> layer_sizes(Index in, const std::vector<std::int64_t>& hidden, Index out) {
  std::vector<int> sizes{static_cast<int>(in)};
  for (const std::int64_t units : hidden) sizes.push_back(static_cast<int>(units));
  sizes.push_back(static_cast<int>(out));
  return sizes;
}

// Layer outputs of a batch. outputs[l]: padded(size_l + 1) x samples for hidden layers (row size_l
// is one), and padded(size) x samples for the last.
template <class S>
struct Tape {
  std::vector<Matrix<S>> outputs;
};

// Space for one chunk on one worker.
template <class S>
struct Scratch {
  Matrix<S> a, b, c, d, e;                           // widest layer x kChunk
  std::vector<Matrix<S>> tangents, tangent_outputs;  // one a hidden layer, for the gradient penalty
  Tape<S> tape;  // kChunk columns; small enough to stay in the caches, as one of a batch is not
};

template <class S>
class Mlp {
 public:
  // sizes: input, hidden..., output.
  Mlp(std::vector<int> sizes, Activation activation);

  Index parameters() const { return parameters_; }
  Index inputs() const { return sizes_.front(); }
  Index outputs() const { return sizes_.back(); }
  const std::vector<int>& sizes() const { return sizes_; }
  Index layers() const { return static_cast<Index>(sizes_.size()) - 1; }
  Index offset(Index layer) const { return offsets_[static_cast<std::size_t>(layer)]; }

  Tape<S> make_tape(Index samples) const;
  Scratch<S> make_scratch() const;

  // Weights uniform in +-sqrt(3 / in) (unit-variance pre-activations), biases zero, last layer
  // times `output_scale`.
  void initialise(S* theta, RandomStream& random, double output_scale) const;

  // x: (inputs + 1) x n, last row ones. Fills columns [first, first + n) of the tape.
  void forward(const S* theta, const ConstView<S>& x, Tape<S>& tape, Index first) const;

  // The last layer's output for columns [first, first + n).
  auto output(const Tape<S>& tape, Index first, Index n) const {
    return tape.outputs.back().block(0, first, outputs(), n);
  }

  // gradient = d/dtheta sum_j <adjoint_j, output_j>; written, not added. adjoint: outputs x n. The
  // tape must hold forward(theta, x). If `input_adjoint` (inputs x n) is given, also d/dx.
  void backward(const S* theta, const ConstView<S>& x, const Tape<S>& tape, Index first,
                const ConstView<S>& adjoint, S* gradient, Scratch<S>& scratch,
                View<S>* input_adjoint = nullptr) const;

  // result (outputs x n) = d/de output(theta + e v) at e = 0.
  void tangent(const S* theta, const S* v, const ConstView<S>& x, const Tape<S>& tape, Index first,
               Scratch<S>& scratch, View<S> result) const;

  // For one output: the penalty sum_j weight (|d output_j / dx_j| - 1)^2 (Gulrajani et al., 2017,
  // eq. 3), its gradient *added* to `gradient`; returns the penalty. The tape must hold
  // forward(theta, x).
  double add_gradient_penalty(const S* theta, const ConstView<S>& x, const Tape<S>& tape,
                              Index first, S weight, S* gradient, Scratch<S>& scratch) const;

 private:
  using ConstWeights = Eigen::Map<const Matrix<S>>;
  using Weights = Eigen::Map<Matrix<S>>;
  Index in(Index layer) const { return sizes_[static_cast<std::size_t>(layer)]; }
  Index out(Index layer) const { return sizes_[static_cast<std::size_t>(layer) + 1]; }
  bool last(Index layer) const { return layer + 1 == layers(); }
  ConstWeights weights(const S* theta, Index layer) const {
    return {theta + offset(layer), out(layer), in(layer) + 1};
  }
  Weights weights(S* theta, Index layer) const {
    return {theta + offset(layer), out(layer), in(layer) + 1};
  }
  // Input of a layer with its row of ones.
  ConstView<S> input(const ConstView<S>& x, const Tape<S>& tape, Index layer, Index first,
                     Index n) const;
  // delta *= f'(z) for the first n columns of delta, scratch space, and n columns of a hidden
  // layer; tanh and the leaky rectifier tell f'(z) from h = f(z).
  void multiply_by_slope(Matrix<S>& delta, const Tape<S>& tape, Index layer, Index first,
                         Index n) const;

  std::vector<int> sizes_;
  Activation activation_;
  std::vector<Index> offsets_;
  Index parameters_ = 0;
};

extern template class Mlp<float>;
extern template class Mlp<double>;

}  // namespace agail
