// The part of a chunk sum's tree that lies across ranks.
//
// Node (c, s) of the tree over chunks [0, n), s a power of two that divides c, is the sum of chunks
// [c, min(c + s, n)), and stands in column c. A rank that has added up what lies within its share
// holds the largest nodes that lie within it; they go to the rank that holds the share before,
// which adds what has become complete, and so on along a binomial tree to rank 0, which has the
// root and sends it to all. So additions are those of one process, in an order that no sum notices.
#pragma once

#include <algorithm>
#include <cstring>

#include "agail/base/error.h"
#include "agail/comm/collectives.h"
#include "agail/comm/team.h"
#include "agail/nn/matrix.h"

namespace agail {

// Calls visit(column) for the largest nodes within `share`, from left to right.
template <class Visit>
void for_each_node(Share share, Index chunks, Visit&& visit) {
  for (Index c = share.begin; c < share.end;) {
    visit(c);
    Index size = 1;
    while (c % (2 * size) == 0 && size < chunks && std::min(c + 2 * size, chunks) <= share.end)
      size *= 2;
    c = std::min(c + size, chunks);
  }
}

// Calls add(to, from) for the columns whose nodes become complete when the shares on both sides of
// `border` are put together to `share`, in the order in which they must be added.
template <class Add>
void for_each_joint(Share share, Index border, Index chunks, Add&& add) {
  for (Index size = 1; size < chunks; size *= 2) {
    const Index c = border / (2 * size) * (2 * size);
    const bool crosses = c < border && std::min(c + 2 * size, chunks) > border;
    if (crosses && c + size < chunks && c >= share.begin &&
        std::min(c + 2 * size, chunks) <= share.end)
      add(c, c + size);
  }
}

// Each rank has added up its share of columns; afterwards column 0 is the sum of all on every rank.
// `values`: rows that count; `message`: work space.
template <class S>
void add_along_ranks(Communicator& communicator, Index chunks, Index values, Matrix<S>& partial,
                     Bytes& message) {
  const int rank = communicator.rank(), ranks = communicator.ranks();
  const std::size_t size = static_cast<std::size_t>(values) * sizeof(S);
  const auto share_of_ranks = [&](int first, int last) {
    return Share{share_of_chunks(chunks, ranks, first).begin,
                 share_of_chunks(chunks, ranks, std::min(last, ranks) - 1).end};
  };
  int step = 1;
  for (; step < ranks && rank % (2 * step) == 0; step *= 2) {
    if (rank + step >= ranks) continue;
    communicator.receive(rank + step, message);
    const Share theirs = share_of_ranks(rank + step, rank + 2 * step);
    std::size_t at = 0;
    for_each_node(theirs, chunks, [&](Index c) {
      AGAIL_CHECK(at + size <= message.size());
      std::memcpy(partial.col(c).data(), message.data() + at, size);
      at += size;
    });
    AGAIL_CHECK(at == message.size());
    for_each_joint(share_of_ranks(rank, rank + 2 * step), theirs.begin, chunks,
                   [&](Index to, Index from) {
                     partial.col(to).head(values) += partial.col(from).head(values);
                   });
  }
  if (rank != 0) {
    message.clear();
    for_each_node(share_of_ranks(rank, rank + step), chunks, [&](Index c) {
      const auto* column = reinterpret_cast<const std::byte*>(partial.col(c).data());
      message.insert(message.end(), column, column + size);
    });
    communicator.send(rank - step, message);
  } else {
    message.resize(size);
    std::memcpy(message.data(), partial.data(), size);
  }
  broadcast(communicator, message);
  AGAIL_CHECK(message.size() == size);
  std::memcpy(partial.data(), message.data(), size);
}

}  // namespace agail
