#include "agail/nn/normalizer.h"

#include <algorithm>
#include <cmath>

#include "agail/nn/product.h"

namespace agail {

namespace {
// Keeps channels that hardly move (contact forces in the air) from being blown up; as OpenAI
// Baselines has it.
constexpr double kVarianceFloor = 1e-2;

std::span<double> span_of(Vector<double>& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

// y = clip((x - shift) scale, -limit, limit) for n numbers. y may be x.
template <int n>
void normalize(const float* x, const float* shift, const float* scale, float limit, float* y) {
  using Numbers = Eigen::Array<float, n, 1>;
  using Given = Eigen::Map<const Numbers>;
  Eigen::Map<Numbers> out(y);
  out = ((Given(x) - Given(shift)) * Given(scale)).max(-limit).min(limit);
}
}  // namespace

Normalizer::Normalizer(Index size, bool enabled, double clip)
    : enabled_(enabled),
      clip_(clip),
      mean_(Vector<double>::Zero(size)),
      squares_(Vector<double>::Zero(size)),
      sums_(2 * size, kChunk) {
  refresh();
}

void Normalizer::update(ThreadPool& pool, const Eigen::Ref<const Matrix<float>>& x) {
  if (!enabled_ || x.cols() == 0) return;
  const Index size = mean_.size();
  // Sums of d = x - mean and d^2 over the batch.
  sums_.reserve(x.cols());
  const auto total = sums_.sum(pool, x.cols(), [&](Index, int, Index first, Index n, double* out) {
    Eigen::Map<Vector<double>> sum(out, size);
    Eigen::Map<Vector<double>> square(out + size, size);
    sum.setZero();
    square.setZero();
    for (Index j = first; j < first + n; ++j) {
      for (Index i = 0; i < size; ++i) {
        const double d = static_cast<double>(x(i, j)) - mean_[i];
        sum[i] += d;
        square[i] += d * d;
      }
    }
  });
  const auto n = static_cast<double>(x.cols());
  const double merged = count_ + n;
  for (Index i = 0; i < size; ++i) {
    const double d = total[i] / n;  // mean of the batch - mean
    const double batch_squares = total[size + i] - n * d * d;
    squares_[i] += std::max(0.0, batch_squares) + d * d * count_ * n / merged;
    mean_[i] += d * n / merged;
  }
  count_ = merged;
  refresh();
}

Vector<double> Normalizer::standard_deviation() const {
  if (!enabled_ || count_ == 0) return Vector<double>::Ones(mean_.size());
  return (squares_ / count_).array().max(kVarianceFloor).sqrt();
}

void Normalizer::set(const Vector<double>& mean, const Vector<double>& standard_deviation) {
  count_ = 1;
  mean_ = mean;
  squares_ = standard_deviation.array().square();
  refresh();
}

void Normalizer::refresh() {
  shift_ = mean_.cast<float>();
  if (!enabled_ || count_ == 0)
    scale_ = Vector<float>::Ones(mean_.size());
  else
    scale_ =
        (squares_ / count_).array().max(kVarianceFloor).sqrt().inverse().matrix().cast<float>();
}

void Normalizer::apply(const float* x, float* y) const {
  // Some at a time: of all together Eigen would make packets that slow the physics (product.h).
  constexpr int kNarrow = kNarrowBytes / sizeof(float);
  const Index n = mean_.size();
  if (enabled_) {
    const auto limit = static_cast<float>(clip_);
    const float* shift = shift_.data();
    const float* scale = scale_.data();
    Index i = 0;
    for (; i + kNarrow <= n; i += kNarrow)
      normalize<kNarrow>(x + i, shift + i, scale + i, limit, y + i);
    for (; i < n; ++i) normalize<1>(x + i, shift + i, scale + i, limit, y + i);
  } else {
    std::copy_n(x, n, y);
  }
  y[n] = 1;
}

void Normalizer::apply(ThreadPool& pool, const Matrix<float>& x, Index samples,
                       Matrix<float>& y) const {
  for_each_chunk(pool, samples, [&](int, Index first, Index n) {
    for (Index j = first; j < first + n; ++j) apply(x.col(j).data(), y.col(j).data());
  });
}

void Normalizer::archive(Archive& a) {
  a("count", count_);
  a("mean", span_of(mean_));
  a("squares", span_of(squares_));
  if (a.loading()) refresh();
}

}  // namespace agail
