// Sums over a batch that do not depend on the number of threads.
//
// Chunk c writes its own column; the columns are then added pairwise along the binary tree over
// chunk indices (c += c + 1, then c += c + 2, ...). Every parameter is summed in that order whoever
// does it.
#pragma once

#include <algorithm>

#include "agail/base/thread_pool.h"
#include "agail/nn/matrix.h"

namespace agail {

inline Index chunk_count(Index samples) { return (samples + kChunk - 1) / kChunk; }

// Adds columns 1 .. columns-1 of `partial` into column 0, for rows [first, first + rows).
template <class S>
void add_along_tree(Matrix<S>& partial, Index columns, Index first, Index rows) {
  for (Index stride = 1; stride < columns; stride *= 2)
    for (Index c = 0; c + stride < columns; c += 2 * stride)
      partial.col(c).segment(first, rows) += partial.col(c + stride).segment(first, rows);
}

// Per-chunk sums of `values` numbers, for batches of up to `samples` columns.
template <class S>
class ChunkSums {
 public:
  ChunkSums(Index values, Index samples) : values_(values) { reserve(samples); }

  void reserve(Index samples) {
    if (chunk_count(samples) > partial_.cols())
      partial_.setZero(padded(values_), chunk_count(samples));
  }

  // Calls body(chunk, worker, first, count, column) for each chunk of `samples` columns, where
  // `column` points to `values` numbers that the body must write; returns the sums, valid until the
  // next call.
  template <class Body>
  Eigen::Map<Vector<S>> sum(ThreadPool& pool, Index samples, Body&& body) {
    const Index chunks = chunk_count(samples);
    pool.run(static_cast<int>(chunks), [&](int chunk, int worker) {
      const Index first = chunk * kChunk;
      body(static_cast<Index>(chunk), worker, first, std::min(kChunk, samples - first),
           partial_.col(chunk).data());
    });
    constexpr Index kRows =
        1024;  // rows added at a time, so that they stay in the first-level cache
    const Index parts = (values_ + kRows - 1) / kRows;
    pool.run(static_cast<int>(parts), [&](int part, int) {
      const Index first = part * kRows;
      add_along_tree(partial_, chunks, first, std::min(kRows, values_ - first));
    });
    return {partial_.data(), values_};
  }

 private:
  Index values_;
  Matrix<S> partial_;
};

// body(worker, first, count) for each chunk, where nothing is summed.
template <class Body>
void for_each_chunk(ThreadPool& pool, Index samples, Body&& body) {
  pool.run(static_cast<int>(chunk_count(samples)), [&](int chunk, int worker) {
    const Index first = chunk * kChunk;
    body(worker, first, std::min(kChunk, samples - first));
  });
}

}  // namespace agail
