// Exchanges in which every rank takes part. All ranks must call the same ones in the same order.
#pragma once

#include <span>
#include <vector>

#include "agail/comm/communicator.h"

namespace agail {

// A block of bytes of every rank, in the order of the ranks.
struct Blocks {
  Bytes bytes;
  std::vector<std::size_t> begin;  // ranks + 1 offsets
  std::span<const std::byte> operator[](int rank) const {
    const auto r = static_cast<std::size_t>(rank);
    return std::span(bytes).subspan(begin[r], begin[r + 1] - begin[r]);
  }
};

// Every rank's block to every rank; blocks may differ in size. ceil(log2(ranks)) messages a rank,
// which together carry the other ranks' blocks (Bruck et al., 1997).
void allgather(Communicator& communicator, std::span<const std::byte> own, Blocks& result);

// Rank 0's message to all, along a binomial tree: one message to each other rank.
void broadcast(Communicator& communicator, Bytes& message);

// The largest of all ranks' values.
int largest(Communicator& communicator, int value);

// The rank that differs from rank 0 in `value`, or -1: for what must be equal everywhere.
int first_that_differs(Communicator& communicator, std::uint32_t value);

// The sums over all ranks.
Traffic total_of(Communicator& communicator, const Traffic& own);

}  // namespace agail
