// Chunk sums over ranks are, to the bit, those of one process.
#include <gtest/gtest.h>

#include "agail/nn/chunks.h"
#include "comm/local_ranks.h"
#include "nn/reference.h"

namespace agail {
namespace {

TEST(RankTree, SameBitsForAnyNumberOfRanksAndChunks) {
  constexpr Index values = 3;
  for (const Index chunks : {2, 3, 5, 8, 13, 26, 31, 32, 33, 47, 64, 100, 127, 128, 129}) {
    const Index samples = chunks * kChunk - 7;
    const Matrix<float> data = reference::normal_matrix(values, samples, 1).cast<float>();
    const auto body = [&](Index, int, Index begin, Index n, float* out) {
      Eigen::Map<Vector<float>>(out, values) = data.middleCols(begin, n).rowwise().sum();
    };
    ThreadPool alone(1);
    ChunkSums<float> serial(values, samples);
    const Vector<float> expected = serial.sum(alone, samples, body);
    for (const int ranks : {1, 2, 3, 4, 5, 6, 7, 8, 11, 16}) {
      LocalRanks::run(ranks, [&](Communicator& communicator) {
        ThreadPool pool(1 + communicator.rank() % 2);
        const Team team(pool, communicator);
        ChunkSums<float> sums(values, samples);
        // Twice: what the first sum left behind must not matter.
        for (int round = 0; round < 2; ++round) {
          const Vector<float> total = sums.sum(team, samples, body);
          EXPECT_TRUE(reference::same_bits(total, expected))
              << chunks << " chunks, rank " << communicator.rank() << " of " << ranks;
        }
        EXPECT_EQ(communicator.traffic().messages > 0, team.spreads(chunks));
      });
    }
  }
}

TEST(RankTree, ChunksAreGathered) {
  constexpr Index samples = 20 * kChunk + 5;
  LocalRanks::run(3, [&](Communicator& communicator) {
    ThreadPool pool(1);
    const Team team(pool, communicator);
    Vector<float> values = Vector<float>::Constant(samples + 10, -1);
    for_each_chunk(team, samples, [&](int, Index first, Index count) {
      for (Index j = first; j < first + count; ++j) values[j] = static_cast<float>(j);
    });
    gather_chunks(team, samples, values);
    for (Index j = 0; j < samples; ++j) ASSERT_EQ(values[j], static_cast<float>(j));
    EXPECT_EQ(values[samples], -1);
  });
}

}  // namespace
}  // namespace agail
