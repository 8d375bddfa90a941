// Sums over a batch that do not depend on the number of threads or ranks.
//
// Chunk c writes its own column; the columns are then added pairwise along the binary tree over
// chunk indices (c += c + 1, then c += c + 2, ...). Every parameter is summed in that order whoever
// does it.
#pragma once

#include <algorithm>

#include "agail/comm/team.h"
#include "agail/nn/matrix.h"
#include "agail/nn/rank_tree.h"

namespace agail {

inline Index chunk_count(Index samples) { return (samples + kChunk - 1) / kChunk; }

// Adds what lies within columns [own.begin, own.end) of all `columns` along the tree, for rows
// [first, first + rows); the sum of all is in column 0.
template <class S>
void add_along_tree(Matrix<S>& partial, Index columns, Share own, Index first, Index rows) {
  for (Index stride = 1; stride < columns; stride *= 2) {
    const Index step = 2 * stride;
    for (Index c = (own.begin + step - 1) / step * step;
         c + stride < own.end && std::min(c + step, columns) <= own.end; c += step)
      partial.col(c).segment(first, rows) += partial.col(c + stride).segment(first, rows);
  }
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
  // next call. A team of several ranks calls it for this rank's chunks only (team.share()), and all
  // ranks get the sums.
  template <class Body>
  Eigen::Map<Vector<S>> sum(Team team, Index samples, Body&& body) {
    return sum(team, samples, body, [](Index, const auto&) {});
  }

  // The same, and calls use(first, sums) for blocks of the sums, those from `first` on, as soon as
  // they are there: in the caches of the thread that added them.
  template <class Body, class Use>
  Eigen::Map<Vector<S>> sum(Team team, Index samples, Body&& body, Use&& use) {
    const Index chunks = chunk_count(samples);
    const Share own = team.share(chunks);
    ThreadPool& pool = team.pool();
    pool.run(static_cast<int>(own.size()), [&](int task, int worker) {
      const Index chunk = own.begin + task;
      const Index first = chunk * kChunk;
      body(chunk, worker, first, std::min(kChunk, samples - first), partial_.col(chunk).data());
    });
    constexpr Index kRows = 1024;  // at a time, so that they stay in the first-level cache
    const auto use_rows = [&](Index first, Index rows) {
      use(first, partial_.col(0).segment(first, rows));
    };
    pool.run_blocks(values_, kRows, [&](Index first, Index rows) {
      add_along_tree(partial_, chunks, own, first, rows);
      if (!team.spreads(chunks)) use_rows(first, rows);
    });
    if (team.spreads(chunks)) {
      add_along_ranks(team.communicator(), chunks, values_, partial_, message_);
      pool.run_blocks(values_, kRows, use_rows);
    }
    return {partial_.data(), values_};
  }

 private:
  Index values_;
  Matrix<S> partial_;
  Bytes message_;
};

// body(worker, first, count) for each of this rank's chunks, where nothing is summed.
template <class Body>
void for_each_chunk(Team team, Index samples, Body&& body) {
  const Share own = team.share(chunk_count(samples));
  team.pool().run(static_cast<int>(own.size()), [&](int task, int worker) {
    const Index first = (own.begin + task) * kChunk;
    body(worker, first, std::min(kChunk, samples - first));
  });
}

// Completes values[0, samples), of which every rank has written those of its own chunks.
inline void gather_chunks(Team team, Index samples, Vector<float>& values) {
  const Index chunks = chunk_count(samples);
  if (!team.spreads(chunks)) return;
  const auto range = [&](int rank) {
    const Share share = share_of_chunks(chunks, team.ranks(), rank);
    const Index first = share.begin * kChunk;
    return std::as_writable_bytes(
        std::span(values.data() + first,
                  static_cast<std::size_t>(std::min(share.end * kChunk, samples) - first)));
  };
  Blocks all;
  allgather(team.communicator(), range(team.rank()), all);
  for (int r = 0; r < team.ranks(); ++r) {
    AGAIL_CHECK(all[r].size() == range(r).size());
    std::ranges::copy(all[r], range(r).begin());
  }
}

}  // namespace agail
