#include "agail/demos/mask.h"

#include <gmock/gmock.h>

#include <cmath>

#include "agail/base/error.h"
#include "samples.h"

namespace agail {
namespace {

constexpr MaskPattern kPatterns[] = {MaskPattern::kStep, MaskPattern::kBlock, MaskPattern::kEpisode,
                                     MaskPattern::kDimension};

Demonstrations masked(Demonstrations demonstrations, MaskPattern pattern, double ratio,
                      std::uint64_t seed = 0, std::optional<int> dimension = std::nullopt) {
  remove_actions(demonstrations, {pattern, ratio, seed, dimension});
  return demonstrations;
}

Eigen::Index missing_steps(const DemoEpisode& episode) {
  return (episode.available.col(0).array() == 0).count();
}

bool contains(const Demonstrations& more, const Demonstrations& less) {
  for (std::size_t i = 0; i < more.episodes.size(); ++i)
    if ((more.episodes[i].available.array() > less.episodes[i].available.array()).any())
      return false;
  return true;
}

bool same_mask(const Demonstrations& a, const Demonstrations& b) {
  return contains(a, b) && contains(b, a);
}

TEST(Mask, StepAndBlockAreExactInEachEpisode) {
  for (const MaskPattern pattern : {MaskPattern::kStep, MaskPattern::kBlock})
    for (const double ratio : {0.0, 0.1, 0.25, 0.29, 0.5, 0.75, 0.9, 1.0}) {
      const Demonstrations all = masked(sample({1, 7, 50, 100, 333}), pattern, ratio, 3);
      for (const DemoEpisode& episode : all.episodes)
        EXPECT_EQ(missing_steps(episode),
                  std::floor(ratio * static_cast<double>(episode.steps()) + 0.5 + 1e-9))
            << name_of(pattern) << " " << ratio;
    }
}

TEST(Mask, HalvesGoUpWhateverTheProductRoundsTo) {
  // 0.29 * 50 is 14.499999999999998 in floating point.
  EXPECT_EQ(missing_steps(masked(sample({50}), MaskPattern::kStep, 0.29).episodes[0]), 15);
  EXPECT_EQ(missing_steps(masked(sample({10}), MaskPattern::kStep, 0.25).episodes[0]), 3);
}

TEST(Mask, RemovedEntriesAreNaNAndUnavailableAndTheRestIsUntouched) {
  const Demonstrations whole = sample({40, 60});
  for (const MaskPattern pattern : kPatterns) {
    const Demonstrations all = masked(whole, pattern, 0.5);
    for (std::size_t i = 0; i < all.episodes.size(); ++i) {
      const DemoEpisode& episode = all.episodes[i];
      for (Eigen::Index t = 0; t < episode.steps(); ++t)
        for (Eigen::Index k = 0; k < 3; ++k) {
          if (episode.available(t, k) != 0) {
            EXPECT_EQ(episode.actions(t, k), whole.episodes[i].actions(t, k));
          } else {
            EXPECT_TRUE(std::isnan(episode.actions(t, k)));
          }
        }
      EXPECT_EQ(episode.observations, whole.episodes[i].observations);
    }
  }
  const Demonstrations discrete = masked(discrete_sample({40}), MaskPattern::kStep, 0.5);
  for (Eigen::Index t = 0; t < 40; ++t)
    EXPECT_TRUE(discrete.episodes[0].available(t, 0) == 1 ||
                discrete.episodes[0].actions(t, 0) == 0);
}

TEST(Mask, BlocksAreRunsOfTwenty) {
  const Demonstrations all = masked(sample({1000}), MaskPattern::kBlock, 0.2, 5);
  const auto mask = all.episodes[0].available.col(0);
  int runs = 0;
  for (Eigen::Index t = 0; t < 1000; ++t) runs += mask(t) == 0 && (t == 0 || mask(t - 1) != 0);
  // 200 steps are ten runs, a few more for the episode's ends and the cut, fewer where runs touch.
  EXPECT_GE(runs, 4);
  EXPECT_LE(runs, 12);
}

TEST(Mask, LargerRatiosContainSmallerOnes) {
  const Demonstrations whole = sample({13, 200, 57, 90, 31}, 6);
  for (const MaskPattern pattern : kPatterns)
    for (const std::uint64_t seed : {0U, 1U, 7U}) {
      Demonstrations previous = whole;
      for (int percent = 0; percent <= 100; percent += 5) {
        const Demonstrations next = masked(whole, pattern, percent / 100.0, seed);
        EXPECT_TRUE(contains(next, previous)) << name_of(pattern) << " " << percent;
        previous = next;
      }
      EXPECT_EQ(previous.missing_ratio(), 1);
    }
}

TEST(Mask, TheSeedAloneDecides) {
  const Demonstrations whole = sample({100, 100, 100, 100}, 6);
  for (const MaskPattern pattern : kPatterns) {
    EXPECT_TRUE(same_mask(masked(whole, pattern, 0.5, 4), masked(whole, pattern, 0.5, 4)));
    bool differs = false;
    for (std::uint64_t seed = 5; seed < 15; ++seed)
      differs =
          differs || !same_mask(masked(whole, pattern, 0.5, 4), masked(whole, pattern, 0.5, seed));
    EXPECT_TRUE(differs) << name_of(pattern);
  }
}

TEST(Mask, StepsAreEquallyLikely) {
  std::vector<int> hits(40, 0);
  for (const MaskPattern pattern : {MaskPattern::kStep, MaskPattern::kBlock}) {
    std::fill(hits.begin(), hits.end(), 0);
    for (std::uint64_t seed = 0; seed < 2000; ++seed) {
      const Demonstrations all = masked(sample({40}, 1, 1), pattern, 0.5, seed);
      for (Eigen::Index t = 0; t < 40; ++t)
        hits[static_cast<std::size_t>(t)] += all.episodes[0].available(t, 0) == 0;
    }
    // 2000 draws of 1/2: the standard deviation is 22. For runs the ends of an episode differ a
    // little.
    for (const int count : hits)
      EXPECT_NEAR(count, 1000, pattern == MaskPattern::kStep ? 120 : 250);
  }
}

TEST(Mask, EpisodesAreWholeAndAsCloseAsTheyCan) {
  const Demonstrations all = masked(sample({100, 100, 100, 100, 100}), MaskPattern::kEpisode, 0.5);
  for (const DemoEpisode& episode : all.episodes)
    EXPECT_THAT(missing_steps(episode), testing::AnyOf(0, 100));
  EXPECT_DOUBLE_EQ(all.missing_ratio(), 0.6);  // 2.5 episodes: halves go up
  EXPECT_DOUBLE_EQ(
      masked(sample({100, 100, 100, 100, 100}), MaskPattern::kEpisode, 0.4).missing_ratio(), 0.4);
}

TEST(Mask, DimensionsAreWholeChannels) {
  const Demonstrations one = masked(sample({30, 20}), MaskPattern::kDimension, 1.0 / 3, 0, 1);
  for (const DemoEpisode& episode : one.episodes) {
    EXPECT_TRUE((episode.available.col(1).array() == 0).all());
    EXPECT_TRUE((episode.available.col(0).array() == 1).all());
    EXPECT_TRUE((episode.available.col(2).array() == 1).all());
  }
  EXPECT_DOUBLE_EQ(masked(sample({30}, 6), MaskPattern::kDimension, 0.5).missing_ratio(), 0.5);
  // The named channel goes even where its share rounds to none.
  EXPECT_DOUBLE_EQ(masked(sample({30}, 10), MaskPattern::kDimension, 0.01, 0, 9).missing_ratio(),
                   0.1);
}

TEST(Mask, RemovingAgainOnlyAdds) {
  const Demonstrations first = masked(sample({100}), MaskPattern::kStep, 0.3, 1);
  const Demonstrations second = masked(first, MaskPattern::kDimension, 1.0 / 3, 1);
  EXPECT_TRUE(contains(second, first));
  EXPECT_GT(second.missing_ratio(), first.missing_ratio());
  EXPECT_EQ(second.pattern, "step+dimension");
  EXPECT_TRUE(same_mask(masked(first, MaskPattern::kStep, 0.3, 1), first));
  EXPECT_EQ(masked(first, MaskPattern::kStep, 0.6, 1).pattern, "step");
}

TEST(Mask, RefusesWhatDoesNotFit) {
  for (const double ratio : {-0.1, 1.1, std::nan("")})
    EXPECT_THROW(masked(sample({5}), MaskPattern::kStep, ratio), InputError);
  EXPECT_THROW(masked(sample({5}), MaskPattern::kDimension, 0.5, 0, 3), InputError);
  EXPECT_THROW(masked(sample({5}), MaskPattern::kDimension, 0.5, 0, -1), InputError);
  EXPECT_THROW(masked(sample({5}), MaskPattern::kStep, 0.5, 0, 1), InputError);
  EXPECT_THROW(masked(discrete_sample({5}), MaskPattern::kDimension, 0.5), InputError);
  EXPECT_THROW(mask_pattern("steps"), InputError);
  EXPECT_EQ(mask_pattern("block"), MaskPattern::kBlock);
}

}  // namespace
}  // namespace agail
