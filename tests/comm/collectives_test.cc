#include "agail/comm/collectives.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>

#include "agail/base/error.h"
#include "agail/comm/team.h"
#include "agail/comm/together.h"
#include "comm/local_ranks.h"

namespace agail {
namespace {

// Rank r's block: r % 4 bytes (some are empty) of value r.
Bytes block_of(int rank) {
  return Bytes(static_cast<std::size_t>(rank % 4), static_cast<std::byte>(rank));
}

TEST(Collectives, EveryRankGetsEveryBlock) {
  for (int ranks = 1; ranks <= 17; ++ranks)
    LocalRanks::run(ranks, [&](Communicator& communicator) {
      Blocks all;
      allgather(communicator, block_of(communicator.rank()), all);
      for (int r = 0; r < ranks; ++r)
        EXPECT_TRUE(std::ranges::equal(all[r], block_of(r))) << r << " of " << ranks;
      int logarithm = 0;
      while (1 << logarithm < ranks) ++logarithm;
      EXPECT_EQ(communicator.traffic().messages, logarithm);
    });
}

TEST(Collectives, BroadcastTakesOneMessageForEachOtherRank) {
  for (int ranks = 1; ranks <= 17; ++ranks) {
    std::atomic<std::int64_t> messages{0};
    LocalRanks::run(ranks, [&](Communicator& communicator) {
      Bytes message = block_of(communicator.rank() == 0 ? 3 : 1);
      broadcast(communicator, message);
      EXPECT_EQ(message, block_of(3));
      messages += communicator.traffic().messages;
    });
    EXPECT_EQ(messages, ranks - 1);
  }
}

TEST(Collectives, LargestAndDifferent) {
  LocalRanks::run(5, [](Communicator& communicator) {
    const int rank = communicator.rank();
    EXPECT_EQ(largest(communicator, rank == 3 ? 15 : 0), 15);
    EXPECT_EQ(first_that_differs(communicator, 7), -1);
    EXPECT_EQ(first_that_differs(communicator, rank >= 2 ? 8 : 7), 2);
  });
}

TEST(Team, SharesCoverEverythingOnce) {
  for (int ranks = 1; ranks <= 9; ++ranks)
    for (std::ptrdiff_t tasks = 0; tasks < 300; ++tasks) {
      std::ptrdiff_t next = 0, next_chunk = 0;
      for (int r = 0; r < ranks; ++r) {
        EXPECT_EQ(share_of(tasks, ranks, r).begin, next);
        next = share_of(tasks, ranks, r).end;
        const Share chunks = share_of_chunks(tasks, ranks, r);
        EXPECT_EQ(chunks.begin, next_chunk);
        next_chunk = chunks.end;
        if (tasks >= ranks) {
          EXPECT_GT(chunks.size(), 0);
        }
      }
      EXPECT_EQ(next, tasks);
      EXPECT_EQ(next_chunk, tasks);
    }
}

TEST(Together, AFailureIsEverybodys) {
  LocalRanks::run(3, [](Communicator& communicator) {
    EXPECT_NO_THROW(together(communicator, [] {}));
    try {
      together(communicator, [&] {
        if (communicator.rank() == 1) throw InputError("no such file");
      });
      ADD_FAILURE() << "nothing thrown";
    } catch (const JobFailure& failure) {
      EXPECT_EQ(failure.exit_code, 2);
      EXPECT_EQ(failure.message, "rank 1: no such file");
    }
    try {
      together(communicator, [] { throw SystemError("disk full"); });
      ADD_FAILURE() << "nothing thrown";
    } catch (const JobFailure& failure) {
      EXPECT_EQ(failure.exit_code, 1);
      EXPECT_EQ(failure.message, "disk full");
    }
  });
}

TEST(Together, TheOnlyRanksExceptionsPass) {
  EXPECT_THROW(together(no_other_ranks(), [] { throw InputError("wrong"); }), InputError);
  EXPECT_THROW(or_abort(no_other_ranks(), [] { throw InputError("wrong"); }), InputError);
}

}  // namespace
}  // namespace agail
