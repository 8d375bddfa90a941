#include <gtest/gtest.h>

#include "agail/demos/demonstrations_summary.h"
#include "samples.h"

namespace agail {
namespace {

TEST(DemonstrationsSummary, SaysWhatTheDemonstrationsSay) {
  const Demonstrations demonstrations = sample({4, 6});
  const DemonstrationsSummary summary = summarise(demonstrations);
  EXPECT_EQ(summary.episodes, 2);
  EXPECT_EQ(summary.transitions, 10);
  EXPECT_EQ(summary.missing_ratio, 0);
  EXPECT_EQ(summary.mean_return, 1.25 * 5);
  Demonstrations without = demonstrations;
  without.episodes[1].rewards.clear();
  EXPECT_FALSE(summarise(without).mean_return);
  Demonstrations endless = demonstrations;
  endless.episodes[0].rewards.assign(4, 1.7e308);
  EXPECT_FALSE(summarise(endless).mean_return);
}

TEST(DemonstrationsSummary, TheFingerprintIsOfWhatIsKnown) {
  const Demonstrations demonstrations = sample({4, 6});
  const auto changed = [&](auto&& change) {
    Demonstrations other = demonstrations;
    change(other.episodes[1]);
    return summarise(other).fingerprint != summarise(demonstrations).fingerprint;
  };
  EXPECT_FALSE(changed([](DemoEpisode&) {}));
  EXPECT_TRUE(changed([](DemoEpisode& episode) { episode.observations(6, 3) += 1e-12; }));
  EXPECT_TRUE(changed([](DemoEpisode& episode) { episode.actions(5, 2) += 1e-12; }));
  EXPECT_TRUE(changed([](DemoEpisode& episode) { episode.rewards[0] = 0; }));
  EXPECT_TRUE(changed([](DemoEpisode& episode) { episode.truncations[5] = 1; }));

  // What stands in a missing entry says nothing.
  const auto hidden = [&](double entry) {
    Demonstrations other = demonstrations;
    other.episodes[0].available(1, 1) = 0;
    other.episodes[0].actions(1, 1) = entry;
    return summarise(other).fingerprint;
  };
  EXPECT_EQ(hidden(0.5), hidden(-3));
  EXPECT_NE(hidden(0.5), summarise(demonstrations).fingerprint);

  // The same numbers in episodes of other lengths.
  EXPECT_NE(summarise(sample({5, 5})).fingerprint, summarise(demonstrations).fingerprint);
}

}  // namespace
}  // namespace agail
