#include "agail/nn/mlp.h"

#include <gtest/gtest.h>

#include "nn/reference.h"

namespace agail {
namespace {

using reference::Dual;
using reference::numbers;
using reference::relative_error;

struct Shape {
  std::vector<int> sizes;
  Activation activation;
};

constexpr Index kColumns = 5, kFirst = 3;  // columns of the tape that the pass uses

class MlpTest : public testing::TestWithParam<Shape> {
 protected:
  MlpTest()
      : mlp_(GetParam().sizes, GetParam().activation),
        theta_(reference::normal_vector(mlp_.parameters(), 1, 0.6)),
        x_(reference::network_input(mlp_.inputs(), kColumns, 2)),
        adjoint_(reference::normal_matrix(mlp_.outputs(), kColumns, 3)),
        tape_(mlp_.make_tape(kColumns + kFirst)),
        scratch_(mlp_.make_scratch()) {
    mlp_.forward(theta_.data(), x_, tape_, kFirst);
  }

  template <class T>
  reference::Numbers<T> output(const reference::Numbers<T>& theta, Index column) const {
    return reference::mlp(GetParam().sizes, GetParam().activation, theta.data(),
                          reference::convert<T>(numbers(x_.col(column).head(mlp_.inputs()))));
  }
  // sum_j <adjoint_j, output_j>
  template <class T>
  T weighted(const reference::Numbers<T>& theta) const {
    T sum(0.0);
    for (Index j = 0; j < kColumns; ++j) {
      const auto out = output(theta, j);
      for (Index i = 0; i < mlp_.outputs(); ++i)
        sum = sum + T(adjoint_(i, j)) * out[static_cast<std::size_t>(i)];
    }
    return sum;
  }

  Mlp<double> mlp_;
  Vector<double> theta_;
  Matrix<double> x_, adjoint_;
  Tape<double> tape_;
  Scratch<double> scratch_;
};

TEST_P(MlpTest, ForwardEqualsTheReference) {
  for (Index j = 0; j < kColumns; ++j) {
    const auto expected = output(numbers(theta_), j);
    for (Index i = 0; i < mlp_.outputs(); ++i)
      EXPECT_NEAR(mlp_.output(tape_, kFirst, kColumns)(i, j), expected[static_cast<std::size_t>(i)],
                  1e-13);
  }
}

TEST_P(MlpTest, GradientOfTheOutputs) {
  Vector<double> gradient = Vector<double>::Constant(mlp_.parameters(), 7);  // overwritten
  mlp_.backward(theta_.data(), x_, tape_, kFirst, adjoint_, gradient.data(), scratch_);
  const auto f = [&](const auto& theta) { return weighted(theta); };
  EXPECT_LE(relative_error(gradient, reference::gradient(f, theta_)), 1e-12);
  const auto value = [&](const Vector<double>& theta) {
    mlp_.forward(theta.data(), x_, tape_, kFirst);
    return (adjoint_.array() * mlp_.output(tape_, kFirst, kColumns).array()).sum();
  };
  EXPECT_LE(relative_error(gradient, reference::differences(value, theta_)), 1e-8);
}

TEST_P(MlpTest, GradientOfTheInputs) {
  Vector<double> gradient(mlp_.parameters());
  Matrix<double> d_input(mlp_.inputs(), kColumns);
  View<double> view = d_input;
  mlp_.backward(theta_.data(), x_, tape_, kFirst, adjoint_, gradient.data(), scratch_, &view);
  const auto value = [&](const Vector<double>& inputs) {
    Matrix<double> x = x_;
    x.topRows(mlp_.inputs()) = inputs.reshaped(mlp_.inputs(), kColumns);
    mlp_.forward(theta_.data(), x, tape_, kFirst);
    return (adjoint_.array() * mlp_.output(tape_, kFirst, kColumns).array()).sum();
  };
  const Vector<double> inputs = x_.topRows(mlp_.inputs()).reshaped();
  EXPECT_LE(relative_error(d_input.reshaped(), reference::differences(value, inputs)), 1e-8);
}

TEST_P(MlpTest, Tangent) {
  const Vector<double> v = reference::normal_vector(mlp_.parameters(), 4);
  Matrix<double> result(mlp_.outputs(), kColumns);
  mlp_.tangent(theta_.data(), v.data(), x_, tape_, kFirst, scratch_, result);
  Matrix<double> expected(mlp_.outputs(), kColumns);
  reference::Numbers<Dual<double>> theta;
  for (Index k = 0; k < v.size(); ++k) theta.push_back({theta_[k], v[k]});
  for (Index j = 0; j < kColumns; ++j) {
    const auto out = output(theta, j);
    for (Index i = 0; i < mlp_.outputs(); ++i) expected(i, j) = out[static_cast<std::size_t>(i)].d;
  }
  EXPECT_LE(relative_error(result, expected), 1e-12);

  const double h = 1e-5;
  const auto outputs = [&](const Vector<double>& at) -> Matrix<double> {
    mlp_.forward(at.data(), x_, tape_, kFirst);
    return mlp_.output(tape_, kFirst, kColumns);
  };
  const Matrix<double> difference = (outputs(theta_ + h * v) - outputs(theta_ - h * v)) / (2 * h);
  EXPECT_LE(relative_error(result, difference), 1e-7);
}

// Of networks with one output.
class PenaltyTest : public MlpTest {};

TEST_P(PenaltyTest, ValueAndGradient) {
  const double weight = 0.7;
  const Vector<double> start = reference::normal_vector(mlp_.parameters(), 5);
  Vector<double> gradient = start;  // the penalty's is added to it
  const double penalty = mlp_.add_gradient_penalty(theta_.data(), x_, tape_, kFirst, weight,
                                                   gradient.data(), scratch_);
  gradient -= start;
  const auto f = [&](const auto& theta) {
    using T = std::decay_t<decltype(theta[0])>;
    T sum(0.0);
    for (Index j = 0; j < kColumns; ++j) {
      const T norm =
          reference::input_gradient_norm(GetParam().sizes, GetParam().activation, theta.data(),
                                         numbers(x_.col(j).head(mlp_.inputs())));
      sum = sum + T(weight) * (norm - T(1.0)) * (norm - T(1.0));
    }
    return sum;
  };
  EXPECT_NEAR(penalty, f(numbers(theta_)), 1e-12);
  EXPECT_LE(relative_error(gradient, reference::gradient(f, theta_)), 1e-11);
  const auto value = [&](const Vector<double>& theta) {
    Vector<double> ignored = Vector<double>::Zero(mlp_.parameters());
    mlp_.forward(theta.data(), x_, tape_, kFirst);
    return mlp_.add_gradient_penalty(theta.data(), x_, tape_, kFirst, weight, ignored.data(),
                                     scratch_);
  };
  EXPECT_LE(relative_error(gradient, reference::differences(value, theta_)), 1e-7);
}

// The single-precision network, whose tanh is an approximation of its own.
TEST_P(MlpTest, SinglePrecisionIsCloseToDouble) {
  const Mlp<float> mlp(GetParam().sizes, GetParam().activation);
  const Vector<float> theta = theta_.cast<float>();
  const Matrix<float> x = x_.cast<float>(), adjoint = adjoint_.cast<float>();
  Tape<float> tape = mlp.make_tape(kColumns + kFirst);
  Scratch<float> scratch = mlp.make_scratch();
  Vector<float> gradient(mlp.parameters());
  mlp.forward(theta.data(), x, tape, kFirst);
  mlp.backward(theta.data(), x, tape, kFirst, adjoint, gradient.data(), scratch);
  Vector<double> expected(mlp.parameters());
  mlp_.backward(theta_.data(), x_, tape_, kFirst, adjoint_, expected.data(), scratch_);
  EXPECT_LE(relative_error(gradient.cast<double>().eval(), expected), 2e-6);
}

INSTANTIATE_TEST_SUITE_P(Shapes, MlpTest,
                         testing::Values(Shape{{5, 7, 4, 3}, Activation::kTanh},
                                         Shape{{5, 7, 4, 3}, Activation::kLeakyRelu},
                                         Shape{{4, 9, 6, 1}, Activation::kTanh},
                                         Shape{{4, 9, 6, 1}, Activation::kLeakyRelu},
                                         Shape{{4, 2}, Activation::kTanh},
                                         Shape{{15, 16, 31, 2}, Activation::kTanh}));

INSTANTIATE_TEST_SUITE_P(Shapes, PenaltyTest,
                         testing::Values(Shape{{4, 9, 6, 1}, Activation::kTanh},
                                         Shape{{4, 9, 6, 1}, Activation::kLeakyRelu},
                                         Shape{{3, 17, 1}, Activation::kTanh},
                                         Shape{{3, 5, 8, 6, 1}, Activation::kTanh},
                                         Shape{{4, 1}, Activation::kTanh}));

TEST(Mlp, InitialWeightsAreUniformAndBiasesZero) {
  const Mlp<double> mlp({12, 200, 3}, Activation::kTanh);
  Vector<double> theta = Vector<double>::Constant(mlp.parameters(), 9);
  RandomStream random(1, Purpose::kInitialise);
  mlp.initialise(theta.data(), random, 0.01);
  const auto first = theta.head(12 * 200);
  const double bound = std::sqrt(3.0 / 12);
  EXPECT_LE(first.maxCoeff(), bound);
  EXPECT_GE(first.minCoeff(), -bound);
  // The variance of a uniform number is bound^2 / 3, that of its square's mean known.
  EXPECT_NEAR(first.squaredNorm() / 2400, 1.0 / 12, 5 * (1.0 / 12) * std::sqrt(0.8 / 2400));
  EXPECT_EQ(theta.segment(Index{12} * 200, 200).cwiseAbs().maxCoeff(), 0);
  const auto last = theta.segment(mlp.offset(1), 600);
  EXPECT_LE(last.cwiseAbs().maxCoeff(), 0.01 * std::sqrt(3.0 / 200));
  EXPECT_GT(last.cwiseAbs().maxCoeff(), 0.009 * std::sqrt(3.0 / 200));
  EXPECT_EQ(theta.tail(3).cwiseAbs().maxCoeff(), 0);
}

}  // namespace
}  // namespace agail
