// Running mean and variance of observations, and the normalisation that networks see.
#pragma once

#include "agail/base/archive.h"
#include "agail/base/thread_pool.h"
#include "agail/nn/chunks.h"
#include "agail/nn/matrix.h"

namespace agail {

// y = clip((x - mean) / std, -clip, clip). Statistics are kept in double precision and change only
// in update(); between updates the map is fixed, so a batch is collected and learned from under one
// and the same map.
class Normalizer {
 public:
  // Without `enabled`, y = x.
  Normalizer(Index size, bool enabled, double clip);

  Index size() const { return mean_.size(); }
  bool enabled() const { return enabled_; }
  double count() const { return count_; }

  // Merges the samples (columns of x: size x n) into the statistics (Chan et al., 1979). Same bits
  // for any number of threads.
  void update(ThreadPool& pool, const Eigen::Ref<const Matrix<float>>& x);

  // y: (size + 1) x n, the last row set to one, as networks take it.
  void apply(const float* x, float* y) const;
  void apply(ThreadPool& pool, const Matrix<float>& x, Index samples, Matrix<float>& y) const;

  const Vector<double>& mean() const { return mean_; }
  Vector<double> standard_deviation() const;
  // A map that is given rather than measured, as saved policies have it.
  void set(const Vector<double>& mean, const Vector<double>& standard_deviation);
  double clip() const { return clip_; }

  void archive(Archive& a);

 private:
  void refresh();

  bool enabled_;
  double clip_;
  double count_ = 0;
  Vector<double> mean_, squares_;  // squares: sum of squared deviations from the mean
  Vector<float> shift_, scale_;
  ChunkSums<double> sums_;
};

}  // namespace agail
