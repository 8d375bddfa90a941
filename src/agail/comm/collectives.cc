#include "agail/comm/collectives.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "agail/base/error.h"

namespace agail {

void allgather(Communicator& communicator, std::span<const std::byte> own, Blocks& result) {
  const auto ranks = static_cast<std::size_t>(communicator.ranks());
  const auto rank = static_cast<std::size_t>(communicator.rank());
  // Blocks of rank, rank + 1, ... (cyclic): their number doubles with every message. A message is
  // the sizes of its blocks, then the blocks.
  std::vector<std::uint64_t> sizes{own.size()};
  Bytes held(own.begin(), own.end()), out, in;
  for (std::size_t have = 1; have < ranks; have = sizes.size()) {
    const std::size_t wanted = std::min(have, ranks - have);
    const std::size_t bytes = std::accumulate(
        sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(wanted), std::size_t{0});
    const std::size_t head = wanted * sizeof(std::uint64_t);
    out.resize(head + bytes);
    std::memcpy(out.data(), sizes.data(), head);
    if (bytes > 0) std::memcpy(out.data() + head, held.data(), bytes);
    communicator.exchange(static_cast<int>((rank + ranks - have) % ranks), out,
                          static_cast<int>((rank + have) % ranks), in);
    AGAIL_CHECK(in.size() >= head);
    sizes.resize(have + wanted);
    std::memcpy(sizes.data() + have, in.data(), head);
    held.insert(held.end(), in.begin() + static_cast<std::ptrdiff_t>(head), in.end());
  }
  result.begin.assign(ranks + 1, 0);
  for (std::size_t r = 0; r < ranks; ++r)
    result.begin[r + 1] = result.begin[r] + sizes[(r + ranks - rank) % ranks];
  AGAIL_CHECK(result.begin[ranks] == held.size());
  // Rank 0's block first: `held` begins with this rank's.
  const auto first = static_cast<std::ptrdiff_t>(result.begin[ranks] - result.begin[rank]);
  std::rotate(held.begin(), held.begin() + (rank == 0 ? 0 : first), held.end());
  result.bytes = std::move(held);
}

void broadcast(Communicator& communicator, Bytes& message) {
  const int ranks = communicator.ranks(), rank = communicator.rank();
  // From the rank without the lowest set bit, to those with one lower bit set.
  int step = 1;
  while (step < ranks && rank % (2 * step) == 0) step *= 2;
  if (rank != 0) communicator.receive(rank - step, message);
  for (step /= 2; step > 0; step /= 2)
    if (rank + step < ranks) communicator.send(rank + step, message);
}

int largest(Communicator& communicator, int value) {
  if (communicator.ranks() == 1) return value;
  Blocks all;
  allgather(communicator, std::as_bytes(std::span(&value, 1)), all);
  for (int r = 0; r < communicator.ranks(); ++r) {
    int other = 0;
    AGAIL_CHECK(all[r].size() == sizeof other);
    std::memcpy(&other, all[r].data(), sizeof other);
    value = std::max(value, other);
  }
  return value;
}

int first_that_differs(Communicator& communicator, std::uint32_t value) {
  if (communicator.ranks() == 1) return -1;
  Blocks all;
  allgather(communicator, std::as_bytes(std::span(&value, 1)), all);
  for (int r = 1; r < communicator.ranks(); ++r)
    if (!std::ranges::equal(all[r], all[0])) return r;
  return -1;
}

Traffic total_of(Communicator& communicator, const Traffic& own) {
  Blocks all;
  allgather(communicator, std::as_bytes(std::span(&own, 1)), all);
  Traffic total;
  for (int r = 0; r < communicator.ranks(); ++r) {
    Traffic one;
    AGAIL_CHECK(all[r].size() == sizeof one);
    std::memcpy(&one, all[r].data(), sizeof one);
    total += one;
  }
  return total;
}

}  // namespace agail
