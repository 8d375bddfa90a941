#include "agail/rl/conjugate_gradient.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "nn/reference.h"

namespace agail {
namespace {

TEST(ConjugateGradient, SolvesWhatAFactorisationSolves) {
  constexpr Index n = 30;
  const Matrix<double> b = reference::normal_matrix(n, n, 1);
  const Matrix<double> a = b * b.transpose() / n + Matrix<double>::Identity(n, n);
  const Vector<double> right = reference::normal_vector(n, 2);
  const auto multiply = [&](const Vector<double>& v, Vector<double>& result) { result = a * v; };
  ConjugateGradient<double> solver(n);
  const Vector<double> expected = a.ldlt().solve(right);
  for (int again = 0; again < 2; ++again)  // the second time from the first one's work space
    EXPECT_LE(reference::relative_error(solver.solve(multiply, right, 100), expected), 1e-5);
  // It stops at |residual|^2 < 1e-10; a right-hand side far above that is solved further.
  EXPECT_LE(reference::relative_error(solver.solve(multiply, 1e6 * right, 100), 1e6 * expected),
            1e-10);

  ConjugateGradient<float> single(n);
  const Matrix<float> a_float = a.cast<float>();
  const auto multiply_float = [&](const Vector<float>& v, Vector<float>& result) {
    result = a_float * v;
  };
  const Vector<double> found = single.solve(multiply_float, right.cast<float>(), 50).cast<double>();
  EXPECT_LE(reference::relative_error(found, expected), 1e-5);
}

TEST(ConjugateGradient, CurvatureNeedsNoFurtherProduct) {
  constexpr Index n = 30;
  const Matrix<double> b = reference::normal_matrix(n, n, 1);
  const Matrix<double> a = b * b.transpose() / n + Matrix<double>::Identity(n, n);
  const Vector<double> right = reference::normal_vector(n, 2);
  ConjugateGradient<double> solver(n);
  for (const int iterations : {0, 3, 100}) {  // also far from the solution
    const Vector<double> x =
        solver.solve([&](const Vector<double>& v, Vector<double>& result) { result = a * v; },
                     right, iterations);
    EXPECT_NEAR(solver.curvature(right), x.dot(a * x), 1e-9) << iterations << " iterations";
  }
}

// k different eigenvalues take k iterations.
TEST(ConjugateGradient, EndsAfterAsManyStepsAsThereAreEigenvalues) {
  const Vector<double> diagonal{{1, 1, 4, 4, 9, 9, 9}};
  const Vector<double> right = 1e6 * reference::normal_vector(7, 3);
  int products = 0;
  const auto multiply = [&](const Vector<double>& v, Vector<double>& result) {
    ++products;
    result = diagonal.cwiseProduct(v);
  };
  ConjugateGradient<double> solver(7);
  const Vector<double> expected = right.cwiseQuotient(diagonal);
  EXPECT_LE(reference::relative_error(solver.solve(multiply, right, 3), expected), 1e-10);
  EXPECT_EQ(products, 3);
  EXPECT_GT(reference::relative_error(solver.solve(multiply, right, 2), expected), 1e-3);
  EXPECT_EQ(solver.solve(multiply, Vector<double>::Zero(7), 5), Vector<double>::Zero(7));
}

}  // namespace
}  // namespace agail
