#include "agail/rl/rollout.h"

#include <gtest/gtest.h>

#include "rl/support.h"

namespace agail {
namespace {

struct Walker {
  Walker(const std::string& id, int threads)
      : spec(environment_spec(id)),
        pool(threads),
        network(spec.observation_dim, {8}, spec.action),
        theta(reference::normal_vector(network.parameters(), 1, 0.2).cast<float>()),
        normalizer(spec.observation_dim, true, 5) {}

  Batch batch(Index lanes, Index steps) const {
    return {spec.observation_dim, spec.action.dim, lanes, steps};
  }

  EnvironmentSpec spec;
  ThreadPool pool;
  PolicyNetwork<float> network;
  Vector<float> theta;
  Normalizer normalizer;
  Stopwatch stopwatch;
};

void expect_same(const Batch& a, const Batch& b) {
  EXPECT_TRUE(reference::same_bits(a.observations, b.observations));
  EXPECT_TRUE(reference::same_bits(a.inputs, b.inputs));
  EXPECT_TRUE(reference::same_bits(a.actions, b.actions));
  EXPECT_TRUE(reference::same_bits(a.rewards, b.rewards));
  EXPECT_EQ(a.endings, b.endings);
  EXPECT_EQ(a.diverged, b.diverged);
  ASSERT_EQ(a.finished.size(), b.finished.size());
  for (std::size_t i = 0; i < a.finished.size(); ++i) {
    EXPECT_EQ(a.finished[i].episode_return, b.finished[i].episode_return);
    EXPECT_EQ(a.finished[i].length, b.finished[i].length);
  }
  for (Index j = 0; j < a.size(); ++j) {
    if (a.endings[static_cast<std::size_t>(j)] == Ending::kNone && !a.lane_ends(j)) continue;
    EXPECT_TRUE(reference::same_bits(a.final_observations.col(j), b.final_observations.col(j)));
  }
}

class RolloutTest : public testing::TestWithParam<std::string> {};

TEST_P(RolloutTest, SameBitsForAnyNumberOfThreads) {
  std::vector<Batch> first;
  for (const int threads : {1, 2, 3}) {
    Walker s(GetParam(), threads);
    Collector collector(GetParam(), 4, 7, s.pool);
    Batch batch = s.batch(4, 60);
    for (std::size_t round = 0; round < 3; ++round) {
      collector.collect(s.network, s.theta, s.normalizer, batch, s.stopwatch);
      if (threads == 1)
        first.push_back(batch);
      else
        expect_same(batch, first[round]);
    }
  }
  EXPECT_GT(first[2].finished.size(), 0U);
  EXPECT_FALSE(reference::same_bits(first[0].observations, first[1].observations));
  EXPECT_FALSE(reference::same_bits(first[0].observations.leftCols(60),
                                    first[0].observations.middleCols(60, 60)));
}

TEST_P(RolloutTest, ContinuesFromAnArchive) {
  Walker s(GetParam(), 2);
  Collector whole(GetParam(), 3, 7, s.pool), rest(GetParam(), 3, 7, s.pool);
  Batch a = s.batch(3, 37), b = a;
  TensorStore untouched = archived(whole);  // before the first episode
  whole.collect(s.network, s.theta, s.normalizer, a, s.stopwatch);
  Archive load_untouched(untouched, Archive::Mode::kLoad);
  rest.archive(load_untouched);
  rest.collect(s.network, s.theta, s.normalizer, b, s.stopwatch);
  expect_same(a, b);

  TensorStore store = archived(whole);
  Collector resumed(GetParam(), 3, 7, s.pool);
  Archive load(store, Archive::Mode::kLoad);
  resumed.archive(load);
  for (int round = 0; round < 3; ++round) {
    whole.collect(s.network, s.theta, s.normalizer, a, s.stopwatch);
    resumed.collect(s.network, s.theta, s.normalizer, b, s.stopwatch);
    expect_same(a, b);
  }
  EXPECT_TRUE(same_store(archived(whole), archived(resumed)));
}

// A batch is what an environment says when it is stepped with the batch's actions.
TEST_P(RolloutTest, BatchIsWhatTheEnvironmentSays) {
  Walker s(GetParam(), 1);
  ThreadPool& pool = s.pool;
  s.normalizer.update(pool, reference::normal_matrix(s.spec.observation_dim, 50, 3).cast<float>());
  Collector collector(GetParam(), 2, 9, pool);
  Batch batch = s.batch(2, 150);
  collector.collect(s.network, s.theta, s.normalizer, batch, s.stopwatch);
  std::size_t finished = 0;
  for (std::uint32_t lane = 0; lane < 2; ++lane) {
    const auto environment = make_environment(GetParam());
    std::uint32_t episode = 0;
    RandomStream random(9, Purpose::kReset, lane, episode);
    environment->reset(random);
    double episode_return = 0;
    const auto expect_observation = [&](const Matrix<float>& matrix, Index j) {
      for (Index i = 0; i < matrix.rows(); ++i)
        EXPECT_EQ(matrix(i, j),
                  static_cast<float>(environment->observation()[static_cast<std::size_t>(i)]));
    };
    for (Index j = 150 * lane; j < 150 * (lane + 1); ++j) {
      expect_observation(batch.observations, j);
      std::vector<float> executed(static_cast<std::size_t>(s.spec.action.dim));
      for (std::size_t i = 0; i < executed.size(); ++i) {
        executed[i] = batch.actions(static_cast<Index>(i), j);
        if (!s.spec.action.discrete)
          executed[i] =
              std::min(std::max(executed[i], s.spec.action.low[i]), s.spec.action.high[i]);
      }
      const StepResult result = environment->step(executed);
      EXPECT_EQ(batch.rewards[j], static_cast<float>(result.reward));
      episode_return += result.reward;
      const Ending ending = batch.endings[static_cast<std::size_t>(j)];
      EXPECT_EQ(ending == Ending::kTerminated, result.terminated);
      EXPECT_EQ(ending == Ending::kTruncated, result.truncated && !result.terminated);
      if (ending != Ending::kNone || batch.lane_ends(j))
        expect_observation(batch.final_observations, j);
      if (ending == Ending::kNone) continue;
      ASSERT_LT(finished, batch.finished.size());
      EXPECT_EQ(batch.finished[finished].episode_return, episode_return);
      EXPECT_EQ(batch.finished[finished++].length, environment->elapsed_steps());
      episode_return = 0;
      RandomStream next(9, Purpose::kReset, lane, ++episode);
      environment->reset(next);
    }
  }
  EXPECT_EQ(finished, batch.finished.size());
  Matrix<float> inputs = Matrix<float>::Zero(batch.inputs.rows(), batch.size());
  s.normalizer.apply(pool, batch.observations, batch.size(), inputs);
  EXPECT_TRUE(reference::same_bits(inputs, batch.inputs));
}

INSTANTIATE_TEST_SUITE_P(Environments, RolloutTest, testing::Values("CartPole-v1", "Hopper-v5"),
                         [](const auto& test) {
                           return test.param.substr(0, test.param.find('-'));
                         });

}  // namespace
}  // namespace agail
