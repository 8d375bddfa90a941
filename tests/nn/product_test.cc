#include "agail/nn/product.h"

#include <gtest/gtest.h>

#include <tuple>

namespace agail {
namespace {

// One of the products on random factors of shape m, k, n, all of them blocks within larger
// matrices, against Eigen in double precision.
template <class S>
class Case {
 public:
  Case(Index m, Index k, Index n) : m_(m), k_(k), n_(n) {
    c_ = Matrix<S>::Random(m + kMargin, n + 1);
  }

  enum Kind { kPlain, kLeftTransposed, kRightTransposed };

  void check(Kind kind, bool add) {
    const auto [a_rows, a_cols] = kind == kLeftTransposed ? std::tuple(k_, m_) : std::tuple(m_, k_);
    const auto [b_rows, b_cols] =
        kind == kRightTransposed ? std::tuple(n_, k_) : std::tuple(k_, n_);
    // The left factor ends where its memory ends, so that a sanitizer sees a read past it.
    const Matrix<S> a = Matrix<S>::Random(a_rows, a_cols);
    const Matrix<S> b = Matrix<S>::Random(b_rows + 3, b_cols);
    const Matrix<S> before = c_;
    View<S> c = c_.block(0, 0, m_, n_);
    const auto right = b.topRows(b_rows);
    if (kind == kPlain) multiply<S>(a, right, c, add);
    if (kind == kLeftTransposed) multiply_transposed<S>(a, right, c);
    if (kind == kRightTransposed) multiply_by_transposed<S>(a, right, c, add);

    const Matrix<double> left = kind == kLeftTransposed
                                    ? Matrix<double>(a.template cast<double>().transpose())
                                    : Matrix<double>(a.template cast<double>());
    const Matrix<double> other = kind == kRightTransposed
                                     ? Matrix<double>(right.template cast<double>().transpose())
                                     : Matrix<double>(right.template cast<double>());
    Matrix<double> expected = left * other;
    if (add) expected += before.block(0, 0, m_, n_).template cast<double>();
    const double tolerance =
        static_cast<double>(Eigen::NumTraits<S>::epsilon()) * static_cast<double>(k_ + 2);
    EXPECT_LE((c_.block(0, 0, m_, n_).template cast<double>() - expected).cwiseAbs().maxCoeff(),
              tolerance)
        << m_ << " x " << k_ << " x " << n_ << " kind " << kind << " add " << add;
    EXPECT_EQ(c_.bottomRows(kMargin), before.bottomRows(kMargin)) << "wrote past the rows";
    EXPECT_EQ(c_.col(n_), before.col(n_)) << "wrote past the columns";
  }

 private:
  static constexpr Index kMargin = 20;
  Index m_, k_, n_;
  Matrix<S> c_;
};

template <class S>
void check_shapes() {
  for (const Index m : {1, 3, 7, 8, 15, 16, 17, 31, 33, 64, 100, 113, 130})
    for (const Index k : {1, 12, 101, 256, 300})
      for (const Index n : {1, 2, 5, 13, 64}) {
        Case<S> shape(m, k, n);
        for (const bool add : {false, true}) {
          shape.check(Case<S>::kPlain, add);
          shape.check(Case<S>::kRightTransposed, add);
        }
        shape.check(Case<S>::kLeftTransposed, false);
      }
}

TEST(Product, EqualsEigensForAllShapesInSinglePrecision) { check_shapes<float>(); }
TEST(Product, EqualsEigensForAllShapesInDoublePrecision) { check_shapes<double>(); }

// A column alone is computed with narrower packets and without its zeros; nobody may see that. Not
// of tiny factors, which are left to Eigen.
template <class S>
void check_column_alone() {
  for (const Index m : {1, 3, 6, 15, 16, 17, 31, 64, 100, 130, 300})
    for (const Index k : {1, 12, 16, 101, 300}) {
      if (m < 16 && k < 16) continue;
      const Matrix<S> a = Matrix<S>::Random(m, k);
      Matrix<S> b = Matrix<S>::Random(k, 13);
      for (Index j = 0; j < b.cols(); ++j)
        for (Index p = 0; p < k; p += j + 1) b(p, j) = p % 2 == 0 ? S(0) : S(-0.0);
      for (const bool add : {false, true}) {
        Matrix<S> together = Matrix<S>::Ones(m, 13);
        multiply<S>(a, b, together, add);
        for (Index j = 0; j < b.cols(); ++j) {
          Matrix<S> alone = Matrix<S>::Ones(m, 1);
          multiply<S>(a, b.middleCols(j, 1), alone, add);
          EXPECT_EQ(alone.col(0), together.col(j)) << m << " x " << k << ", column " << j;
        }
      }
    }
}

TEST(Product, SameBitsForAColumnAloneAndAmongOthers) {
  check_column_alone<float>();
  check_column_alone<double>();
}

}  // namespace
}  // namespace agail
