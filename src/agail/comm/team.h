// Who works: the threads of this process, and the ranks that it works with.
#pragma once

#include "agail/base/thread_pool.h"
#include "agail/comm/communicator.h"

namespace agail {

// Tasks [begin, end).
struct Share {
  std::ptrdiff_t begin = 0, end = 0;
  std::ptrdiff_t size() const { return end - begin; }
};

// Contiguous and nearly equal; empty where there are more ranks than tasks.
inline Share share_of(std::ptrdiff_t tasks, int ranks, int rank) {
  return {tasks * rank / ranks, tasks * (rank + 1) / ranks};
}

// Chunks of a sum, likewise, but cut where a subtree of the sum ends as far as that does not make
// the shares unequal (by an eighth at most): then few partial sums have to travel.
inline Share share_of_chunks(std::ptrdiff_t chunks, int ranks, int rank) {
  std::ptrdiff_t grain = 1;
  while (16 * grain <= chunks / ranks) grain *= 2;
  const auto cut = [&](int r) { return r == ranks ? chunks : chunks * r / ranks / grain * grain; };
  return {cut(rank), cut(rank + 1)};
}

// Cheap to copy. Whoever is given a ThreadPool works alone: what it computes, every rank computes.
class Team {
 public:
  Team(ThreadPool& pool, Communicator& communicator) : pool_(&pool), communicator_(&communicator) {}
  Team(ThreadPool& pool) : Team(pool, no_other_ranks()) {}  // NOLINT(google-explicit-constructor)

  ThreadPool& pool() const { return *pool_; }
  Communicator& communicator() const { return *communicator_; }
  int rank() const { return communicator_->rank(); }
  int ranks() const { return communicator_->ranks(); }

  // Whether chunks are spread over the ranks: two a rank take longer than their sum's way. The bits
  // do not depend on it.
  bool spreads(std::ptrdiff_t chunks) const {
    return ranks() > 1 && chunks >= std::ptrdiff_t{2} * ranks();
  }
  Share share(std::ptrdiff_t chunks) const {
    return spreads(chunks) ? share_of_chunks(chunks, ranks(), rank()) : Share{0, chunks};
  }

 private:
  ThreadPool* pool_;
  Communicator* communicator_;
};

}  // namespace agail
