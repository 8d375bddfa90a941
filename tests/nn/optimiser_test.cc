#include <gtest/gtest.h>

#include "agail/nn/adam.h"
#include "agail/nn/chunks.h"
#include "agail/nn/normalizer.h"
#include "nn/reference.h"

namespace agail {
namespace {

// As the paper's Algorithm 1 has it, number by number. More parameters than one block of the
// implementation.
TEST(Adam, EqualsThePlainAlgorithm) {
  constexpr Index n = 1500;
  const Vector<double> target = reference::normal_vector(n, 1);
  Vector<double> theta = reference::normal_vector(n, 2), expected = theta;
  std::vector<double> m(n, 0), v(n, 0);
  Adam<double> adam(n);
  ThreadPool pool(2);
  for (int t = 1; t <= 50; ++t) {
    const double rate = 0.01 / t;
    adam.descend(pool, theta, theta - target, rate);
    for (Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double g = expected[i] - target[i];
      m[k] = 0.9 * m[k] + 0.1 * g;
      v[k] = 0.999 * v[k] + 0.001 * g * g;
      const double m_hat = m[k] / (1 - std::pow(0.9, t)), v_hat = v[k] / (1 - std::pow(0.999, t));
      expected[i] -= rate * m_hat / (std::sqrt(v_hat) + 1e-8);
    }
  }
  EXPECT_LE(reference::relative_error(theta, expected), 1e-12);
}

TEST(Adam, SameBitsInParts) {
  constexpr Index n = 50;
  const Vector<float> gradient = reference::normal_vector(n, 2).cast<float>();
  Vector<float> whole = reference::normal_vector(n, 1).cast<float>(), parts = whole;
  Adam<float> together(n), apart(n);
  ThreadPool pool(1);
  for (int i = 0; i < 3; ++i) {
    together.descend(pool, whole, gradient, 1e-2);
    const auto step = apart.begin_step(1e-2);
    apart.descend(step, parts.tail(34), gradient.tail(34), 16);
    apart.descend(step, parts.head(16), gradient.head(16), 0);
  }
  EXPECT_TRUE(reference::same_bits(whole, parts));
}

TEST(Adam, ContinuesFromAnArchive) {
  const Vector<float> start = reference::normal_vector(40, 1).cast<float>();
  const Vector<float> gradient = reference::normal_vector(40, 2).cast<float>();
  Adam<float> whole(40), half(40), rest(40);
  ThreadPool pool(1);
  Vector<float> a = start, b = start;
  for (int i = 0; i < 6; ++i) whole.descend(pool, a, gradient * static_cast<float>(i), 1e-2);
  for (int i = 0; i < 3; ++i) half.descend(pool, b, gradient * static_cast<float>(i), 1e-2);
  TensorStore store;
  Archive save(store, Archive::Mode::kSave), load(store, Archive::Mode::kLoad);
  half.archive(save);
  rest.archive(load);
  for (int i = 3; i < 6; ++i) rest.descend(pool, b, gradient * static_cast<float>(i), 1e-2);
  EXPECT_TRUE(reference::same_bits(a, b));
}

TEST(ChunkSums, SameBitsForAnyNumberOfThreads) {
  constexpr Index values = 3000;
  for (const Index samples : {1, 64, 65, 500, 64 * 13}) {
    const Matrix<float> data = reference::normal_matrix(values, samples, 1).cast<float>();
    Vector<float> first;
    for (const int threads : {1, 2, 3, 8}) {
      ThreadPool pool(threads);
      ChunkSums<float> sums(values, samples);
      const Vector<float> total =
          sums.sum(pool, samples, [&](Index, int, Index begin, Index n, float* out) {
            Eigen::Map<Vector<float>>(out, values) = data.middleCols(begin, n).rowwise().sum();
          });
      if (threads == 1) {
        first = total;
        const Vector<double> expected = data.cast<double>().rowwise().sum();
        EXPECT_LE((total.cast<double>() - expected).cwiseAbs().maxCoeff(), 1e-4);
      }
      EXPECT_TRUE(reference::same_bits(total, first)) << threads << " threads";
    }
  }
}

// A sum along the tree is ((c0 + c1) + (c2 + c3)) + c4, which other orders do not give.
TEST(ChunkSums, HandsOutEachSumOnce) {
  constexpr Index values = 3000;
  const auto body = [](Index chunk, int, Index, Index, float* out) {
    for (Index i = 0; i < values; ++i) out[i] = static_cast<float>(i * (chunk + 1));
  };
  for (const int threads : {1, 3}) {
    ThreadPool pool(threads);
    ChunkSums<float> sums(values, 2 * kChunk);
    Vector<float> used = Vector<float>::Zero(values);
    const Vector<float> total =
        sums.sum(pool, 2 * kChunk, body,
                 [&](Index first, const auto& some) { used.segment(first, some.size()) += some; });
    EXPECT_EQ(used, total);
    EXPECT_EQ(total[7], 7.0F * (1 + 2));
  }
}

TEST(ChunkSums, AddsAlongTheBinaryTree) {
  ThreadPool pool(2);
  const std::vector<float> c{1e8F, 3, -1e8F, 5, 7};
  ChunkSums<float> sums(1, 5 * kChunk);
  const auto total = sums.sum(pool, 5 * kChunk, [&](Index chunk, int, Index, Index, float* out) {
    *out = c[static_cast<std::size_t>(chunk)];
  });
  volatile float a = c[0] + c[1], b = c[2] + c[3];
  volatile float ab = a + b;
  EXPECT_EQ(total[0], ab + c[4]);
}

TEST(Normalizer, BatchesMergeToTheMomentsOfAllData) {
  constexpr Index size = 7, n = 1000;
  Matrix<float> x = reference::normal_matrix(size, n, 1).cast<float>();
  for (Index i = 0; i < size; ++i)
    x.row(i).array() =
        x.row(i).array() * static_cast<float>(i + 1) + 20.0F * static_cast<float>(i * i);
  Vector<double> mean = Vector<double>::Zero(size), variance = mean;
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j < n; ++j) mean[i] += static_cast<double>(x(i, j)) / n;
    for (Index j = 0; j < n; ++j)
      variance[i] += std::pow(static_cast<double>(x(i, j)) - mean[i], 2) / n;
  }
  Normalizer first(size, true, 5);
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    Normalizer normalizer(size, true, 5);
    Index begin = 0;
    for (const Index count : {1, 63, 300, 136, 500}) {
      normalizer.update(pool, x.middleCols(begin, count));
      begin += count;
    }
    ASSERT_EQ(begin, n);
    EXPECT_EQ(normalizer.count(), n);
    EXPECT_LE(reference::relative_error(normalizer.mean(), mean), 1e-12);
    const Vector<double> deviation = normalizer.standard_deviation();
    EXPECT_LE(reference::relative_error(deviation, variance.cwiseSqrt()), 1e-10);
    if (threads == 1) first = normalizer;
    EXPECT_TRUE(reference::same_bits(normalizer.mean(), first.mean()));
    EXPECT_TRUE(reference::same_bits(deviation, first.standard_deviation()));
  }
}

TEST(Normalizer, ClipsAndAppendsAOne) {
  ThreadPool pool(1);
  Normalizer normalizer(2, true, 1.5);
  normalizer.set(Vector<double>{{1, 2}}, Vector<double>{{0.5, 4}});
  Matrix<float> x(2, 2);
  x << 1.25F, 5, 0, -90;
  Matrix<float> y(3, 2);
  normalizer.apply(pool, x, 2, y);
  Matrix<float> expected(3, 2);
  expected << 0.5F, 1.5F, -0.5F, -1.5F, 1, 1;
  EXPECT_EQ(y, expected);

  // A channel that does not move is divided by a tenth, not by zero.
  Normalizer still(1, true, 5);
  still.update(pool, Matrix<float>::Constant(1, 10, 3));
  EXPECT_DOUBLE_EQ(still.standard_deviation()[0], 0.1);

  Normalizer off(2, false, 1.5);
  off.update(pool, x);
  off.apply(pool, x, 2, y);
  EXPECT_EQ(y.topRows(2), x);
  EXPECT_EQ(y.row(2), Matrix<float>::Ones(1, 2));
}

TEST(Normalizer, ContinuesFromAnArchive) {
  ThreadPool pool(2);
  const Matrix<float> x = reference::normal_matrix(3, 100, 1).cast<float>();
  Normalizer a(3, true, 5), b(3, true, 5);
  a.update(pool, x.leftCols(40));
  TensorStore store;
  Archive save(store, Archive::Mode::kSave), load(store, Archive::Mode::kLoad);
  a.archive(save);
  b.archive(load);
  a.update(pool, x.rightCols(60));
  b.update(pool, x.rightCols(60));
  Matrix<float> ya(4, 100), yb(4, 100);
  a.apply(pool, x, 100, ya);
  b.apply(pool, x, 100, yb);
  EXPECT_TRUE(reference::same_bits(ya, yb));
}

}  // namespace
}  // namespace agail
