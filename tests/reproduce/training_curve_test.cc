#include "agail/reproduce/training_curve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace agail {
namespace {

using Episodes = std::vector<TrainingEpisode>;

TEST(TrainingCurve, MovingAverageUsesWhatThereIs) {
  const Episodes smooth = moving_average(Episodes{{1, 3}, {2, 5}, {3, 10}, {4, 0}}, 1);
  EXPECT_DOUBLE_EQ(smooth[0].episode_return, 4);
  EXPECT_DOUBLE_EQ(smooth[1].episode_return, 6);
  EXPECT_DOUBLE_EQ(smooth[2].episode_return, 5);
  EXPECT_DOUBLE_EQ(smooth[3].episode_return, 5);
  EXPECT_DOUBLE_EQ(smooth[3].end, 4);
}

TEST(TrainingCurve, WeightsFallByEForEachSpacing) {
  // Positions 0, 2, 4; the episode at 2 counts twice at its own position.
  const Episodes episodes = {{0, 1}, {2, 10}, {5, 100}};
  const std::vector<double> curve = symmetric_moving_average(episodes, 0, 4, 3);
  const auto mean = [](double a, double b, double c) {
    return (a * 1 + b * 10 + c * 100) / (a + b + c);
  };
  EXPECT_NEAR(curve[0], mean(2, std::exp(-1.0), std::exp(-2.5)), 1e-9);
  EXPECT_NEAR(curve[1], mean(std::exp(-1.0), 2, std::exp(-1.5)), 1e-9);
  EXPECT_NEAR(curve[2], mean(std::exp(-2.0), std::exp(-1.0), std::exp(-0.5)), 1e-9);
}

// From what a record keeps follows what the whole run would give.
TEST(TrainingCurve, TheTailIsEnough) {
  std::vector<TrainingCurve> kept;
  std::vector<Episodes> whole;
  constexpr double kBudget = 20'000, kLongest = 100;
  for (int seed = 0; seed < 3; ++seed) {
    Episodes episodes;
    double end = 0;
    for (int i = 0; end < kBudget + 1000; ++i) {
      end += 20 + (i * 37 + seed * 11) % 80;
      episodes.push_back({end, std::sin(i * 0.1) + seed + 1e-3 * i});
    }
    kept.push_back(training_curve(episodes, kBudget, kLongest));
    whole.push_back(moving_average(episodes, kPaperRadius));
    std::erase_if(whole.back(), [&](const TrainingEpisode& e) { return e.end > kBudget; });
    EXPECT_LT(kept.back().tail.size(), whole.back().size() / 8);
    EXPECT_EQ(kept.back().curve.size(), 65U);
  }
  double low = 0, high = kBudget;
  for (const Episodes& episodes : whole) {
    low = std::max(low, episodes.front().end);
    high = std::min(high, episodes.back().end);
  }
  const auto values = last_points(kept);
  ASSERT_TRUE(values);
  for (std::size_t i = 0; i < whole.size(); ++i)
    EXPECT_NEAR((*values)[i], symmetric_moving_average(whole[i], low, high, kPaperPoints).back(),
                2e-4);
}

TEST(TrainingCurve, WithoutAFinishedEpisodeThereIsNoStatistic) {
  const TrainingCurve none = training_curve(Episodes{{150, 1}}, 100, 200);
  EXPECT_EQ(none.episodes, 0);
  const TrainingCurve some = training_curve(Episodes{{10, 1}, {50, 2}}, 100, 200);
  EXPECT_FALSE(last_points(std::vector{some, none}));
  EXPECT_FALSE(last_points(std::vector<TrainingCurve>{}));
  EXPECT_TRUE(last_points(std::vector{some}));
}

}  // namespace
}  // namespace agail
