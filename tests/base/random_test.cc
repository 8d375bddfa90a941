#include "agail/base/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <vector>

namespace agail {
namespace {

std::array<std::uint32_t, 4> block(RandomStream stream, std::uint32_t skipped) {
  for (std::uint64_t i = 0; i < 4ULL * skipped; ++i) stream.bits();
  return {stream.bits(), stream.bits(), stream.bits(), stream.bits()};
}

// Random123's kat_vectors, "philox4x32 10". A stream's counter is (purpose << 24 | block, lane,
// episode, step), so the vector with counter 243f6a88 ... is block 0x3f6a88 of purpose 0x24.
TEST(RandomStream, PublishedVectors) {
  const RandomStream zeros(0, Purpose{0});
  EXPECT_EQ(block(zeros, 0),
            (std::array<std::uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const RandomStream pi(0x299f31d0a4093822, Purpose{0x24}, 0x85a308d3, 0x13198a2e, 0x03707344);
  EXPECT_EQ(block(pi, 0x3f6a88),
            (std::array<std::uint32_t, 4>{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(RandomStream, EveryPartOfTheNameCounts) {
  std::set<std::uint32_t> firsts;
  firsts.insert(RandomStream(0, Purpose::kAct).bits());
  firsts.insert(RandomStream(1, Purpose::kAct).bits());
  firsts.insert(RandomStream(1ULL << 32, Purpose::kAct).bits());
  firsts.insert(RandomStream(0, Purpose::kReset).bits());
  firsts.insert(RandomStream(0, Purpose::kAct, 1).bits());
  firsts.insert(RandomStream(0, Purpose::kAct, 0, 1).bits());
  firsts.insert(RandomStream(0, Purpose::kAct, 0, 0, 1).bits());
  EXPECT_EQ(firsts.size(), 7U);
}

TEST(RandomStream, UniformIsInTheUnitInterval) {
  RandomStream random(3, Purpose::kAct);
  double sum = 0, low = 1, high = 0;
  constexpr int n = 200000;
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform();
    sum += u;
    low = std::min(low, u);
    high = std::max(high, u);
  }
  EXPECT_GE(low, 0);
  EXPECT_LT(high, 1);
  EXPECT_NEAR(sum / n, 0.5, 5 * std::sqrt(1.0 / 12 / n));
}

// A sum of (observed - expected)^2 / expected stays within 5 deviations of a chi-squared's mean.
TEST(RandomStream, BelowIsUniform) {
  for (const std::uint32_t n : {2U, 3U, 7U, 100U}) {
    RandomStream random(n, Purpose::kShuffle);
    std::vector<double> count(n, 0);
    constexpr int draws = 100000;
    for (int i = 0; i < draws; ++i) count.at(random.below(n)) += 1;
    const double expected = static_cast<double>(draws) / n;
    double chi = 0;
    for (const double c : count) chi += (c - expected) * (c - expected) / expected;
    EXPECT_LT(chi, n - 1 + 5 * std::sqrt(2.0 * (n - 1))) << n;
  }
  EXPECT_EQ(RandomStream(0, Purpose::kShuffle).below(1), 0U);
}

// Taking bits modulo 3 * 2^30 would give the first third twice as often as the others.
TEST(RandomStream, BelowIsUnbiasedForLargeRanges) {
  constexpr std::uint32_t n = 3U << 30;
  RandomStream random(5, Purpose::kShuffle);
  std::array<int, 3> thirds{};
  for (int i = 0; i < 90000; ++i) ++thirds[random.below(n) >> 30];
  for (const int count : thirds) EXPECT_NEAR(count, 30000, 5 * std::sqrt(30000.0 * 2 / 3));
}

TEST(RandomStream, NormalMoments) {
  RandomStream random(4, Purpose::kAct);
  constexpr int n = 400000;
  std::array<double, 5> moment{};
  int beyond_two = 0;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    ASSERT_TRUE(std::isfinite(x));
    for (int power = 1; power <= 4; ++power)
      moment.at(static_cast<std::size_t>(power)) += std::pow(x, power) / n;
    beyond_two += std::abs(x) > 2;
  }
  // Deviations of the sample moments: sqrt(1, 2, 15, 96) / sqrt(n).
  EXPECT_NEAR(moment[1], 0, 5 * std::sqrt(1.0 / n));
  EXPECT_NEAR(moment[2], 1, 5 * std::sqrt(2.0 / n));
  EXPECT_NEAR(moment[3], 0, 5 * std::sqrt(15.0 / n));
  EXPECT_NEAR(moment[4], 3, 5 * std::sqrt(96.0 / n));
  EXPECT_NEAR(beyond_two / double{n}, 0.0455003, 5 * std::sqrt(0.0455 / n));
}

}  // namespace
}  // namespace agail
