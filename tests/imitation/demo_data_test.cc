#include "agail/imitation/demo_data.h"

#include <gtest/gtest.h>

#include "imitation/support.h"

namespace agail {
namespace {

TEST(DemoData, TheNextStateOfALastStepIsTheEpisodesLastObservation) {
  const Demonstrations demonstrations = random_demonstrations("Hopper-v5", 3, 1);
  const DemoData data(demonstrations);
  Index column = 0;
  for (const DemoEpisode& episode : demonstrations.episodes)
    for (Index t = 0; t < episode.steps(); ++t, ++column) {
      const Eigen::Map<const Vector<float>> next(data.next_state(column), data.states.rows());
      EXPECT_EQ(data.states.col(column), episode.observations.row(t).transpose().cast<float>());
      EXPECT_EQ(next, episode.observations.row(t + 1).transpose().cast<float>());
    }
  EXPECT_EQ(column, data.size());
}

TEST(DemoData, ActionsAreThoseThatTheEnvironmentExecutes) {
  Demonstrations demonstrations = random_demonstrations("Hopper-v5", 1, 1);
  DemoEpisode& episode = demonstrations.episodes.front();
  episode.actions.row(0) << 3.0, -0.25, -1.5;
  episode.available.row(0).setOnes();
  episode.actions.row(1).setConstant(7.0);
  episode.available.row(1).setZero();
  const DemoData data(demonstrations);
  EXPECT_EQ(data.actions.col(0), Eigen::Vector3f(1.0F, -0.25F, -1.0F));
  EXPECT_EQ(data.actions.col(1), Eigen::Vector3f::Zero());
}

TEST(DemoData, SaysHowLargeItWillBe) {
  const Demonstrations demonstrations = random_demonstrations("Hopper-v5", 3, 1);
  const DemoData data(demonstrations);
  const auto size = [](const auto& values) {
    return static_cast<std::uint64_t>(values.size()) * sizeof(*values.data());
  };
  EXPECT_EQ(DemoData::memory(demonstrations), size(data.states) + size(data.actions) +
                                                  size(data.available) + size(data.final_states) +
                                                  size(data.ends) + size(data.some_action) +
                                                  size(data.full_action));
}

}  // namespace
}  // namespace agail
