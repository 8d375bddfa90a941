#include "agail/reproduce/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace agail {
namespace {

TEST(Statistics, MeanAndItsErrors) {
  const std::vector<double> values = {1, 2, 6};
  EXPECT_DOUBLE_EQ(mean_of(values), 3);
  EXPECT_DOUBLE_EQ(standard_error_of(values), std::sqrt(14.0 / 2 / 3));
  EXPECT_DOUBLE_EQ(population_standard_error_of(values), std::sqrt(14.0 / 3 / 3));
  EXPECT_DOUBLE_EQ(standard_error_of(std::vector<double>{5}), 0);
}

TEST(Statistics, InterquartileMeanLeavesOutAQuarterAtEachEnd) {
  EXPECT_DOUBLE_EQ(interquartile_mean({100, 1, 2, 3, 4, -50}), 2.5);    // 6 / 4: one at each end
  EXPECT_DOUBLE_EQ(interquartile_mean({8, 1, 2, 3, 4, 5, 6, 7}), 4.5);  // two
  EXPECT_DOUBLE_EQ(interquartile_mean({1, 2, 6}), 3);                   // none
  EXPECT_DOUBLE_EQ(interquartile_mean({7}), 7);
}

// Two values: the mean of two draws is one of the ends with probability 1/4 each.
TEST(Statistics, IntervalOfACaseThatCanBeWorkedOut) {
  const auto [low, high] = interquartile_mean_interval({{0, 1}}, 0);
  EXPECT_EQ(low, 0);
  EXPECT_EQ(high, 1);
  // A stratum that does not vary only halves the other's part.
  const auto [lower, higher] = interquartile_mean_interval({{0, 1}, {0.5}}, 0);
  EXPECT_NEAR(lower, 0.5 / 3, 1e-12);
  EXPECT_NEAR(higher, 2.5 / 3, 1e-12);
}

TEST(Statistics, ProbabilityOfLess) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Estimate p = probability_of_less({{1, 5}, {2}}, {{3, kNever}, {2}}, 0);
  EXPECT_DOUBLE_EQ(p.value, (0.75 + 0.5) / 2);
  EXPECT_EQ(p.low, 0.25);   // both draws of 5, both of 3: 0, and the tie
  EXPECT_EQ(p.high, 0.75);  // 1 and the tie
  const Estimate sure = probability_of_less({{1, 2}}, {{3, kNever}}, 0);
  EXPECT_EQ(sure.value, 1);
  EXPECT_EQ(sure.low, 1);
  const Estimate nobody = probability_of_less({{kNever}}, {{kNever}}, 0);
  EXPECT_EQ(nobody.value, 0.5);
}

}  // namespace
}  // namespace agail
