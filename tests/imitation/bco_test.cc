#include "agail/imitation/bco.h"

#include <gtest/gtest.h>

#include "imitation/support.h"

namespace agail {
namespace {

// A demonstrator that keeps still what moves by itself, s' = 0.9 s + a with a = -0.5 s, and shows
// no action. The own transitions are of random actions at random states.
class BcoTest : public testing::Test {
 protected:
  static constexpr Index kOwn = 1000, kShown = 600;

  static Demonstrations shown() {
    Matrix<double> states = Matrix<double>::Zero(2, kShown + 1), actions(2, kShown);
    RandomStream random(2, Purpose::kRecord);
    states(0, 0) = 1;
    for (Index t = 0; t < kShown; ++t) {
      if (t % 6 == 0)
        for (Index i = 0; i < 2; ++i) states(i, t) = random.uniform(-1, 1);
      actions.col(t) = -0.5 * states.col(t);
      states.col(t + 1) = 0.9 * states.col(t) + actions.col(t);
    }
    // Episodes of six steps: the jump between two of them is no transition.
    Demonstrations demos = demonstrations_from(states, actions, continuous_actions(2, 1));
    const DemoEpisode whole = demos.episodes.front();
    demos.episodes.clear();
    for (Index t = 0; t + 6 <= kShown; t += 6) {
      DemoEpisode episode;
      episode.observations = whole.observations.middleRows(t, 7);
      episode.observations.row(6) = 0.4 * episode.observations.row(5);
      episode.actions = whole.actions.middleRows(t, 6);
      episode.available = RowMatrix<std::uint8_t>::Ones(6, 2);
      episode.terminations.assign(6, 0);
      episode.truncations.assign(6, 0);
      demos.episodes.push_back(std::move(episode));
    }
    remove_actions(demos, {.pattern = MaskPattern::kStep, .ratio = 1, .seed = 1, .dimension = {}});
    return demos;
  }

  static Batch own() {
    Batch batch(2, 2, 1, kOwn);
    RandomStream random(1, Purpose::kAct);
    for (Index j = 0; j < kOwn; ++j) {
      for (Index i = 0; i < 2; ++i) {
        batch.observations(i, j) = static_cast<float>(random.uniform(-1, 1));
        batch.actions(i, j) = static_cast<float>(random.uniform(-1.5, 1.5));
      }
      // Every step ends an episode, so that the next state is the one stored with it.
      batch.endings[static_cast<std::size_t>(j)] = Ending::kTruncated;
      const Vector<float> executed = batch.actions.col(j).cwiseMax(-1.0F).cwiseMin(1.0F);
      batch.final_observations.col(j) = 0.9F * batch.observations.col(j) + executed;
    }
    return batch;
  }

  static Settings settings() {
    Settings s;
    s.inverse_dynamics.hidden = {32};
    s.bco.every = 2;
    s.bco.buffer = 1500;
    s.bco.epochs = 400;
    s.start.log_std = -1.5;
    return s;
  }
};

TEST_F(BcoTest, LearnsFromStatesAloneWhatTheDemonstratorDid) {
  const DemoData demos(shown());
  ASSERT_TRUE(demos.some_action.empty());
  ThreadPool pool(1);
  const ActionSpace space = continuous_actions(2, 1);
  const PolicyNetwork<float> network(2, {32}, space);
  Normalizer normalizer(2, true, 5);
  normalizer.update(pool, demos.states);
  Vector<float> theta(network.parameters());
  RandomStream random(3, Purpose::kInitialise);
  network.initialise(theta.data(), random, 0);
  BehaviorCloningFromObservation bco(network, normalizer, demos, space, settings(), pool, 1);

  const Vector<float> before = theta;
  CloningTargets targets;
  EXPECT_FALSE(bco.update(own(), 0, theta, targets));
  EXPECT_EQ(theta, before);  // in the middle of a round
  const std::optional<BcoReport> report = bco.update(own(), 1, theta, targets);
  ASSERT_TRUE(report);
  EXPECT_GT(report->inverse_dynamics.quality, 0.98);
  EXPECT_GT(report->cloning.quality, 0.95);
  EXPECT_EQ(targets.available.minCoeff(), 1);
  EXPECT_LT((targets.actions + 0.5F * demos.states).squaredNorm(),
            0.05F * (0.5F * demos.states).squaredNorm());
  EXPECT_FLOAT_EQ(network.log_std(theta.data())[1], -1.5F);

  Matrix<float> x = Matrix<float>::Zero(padded(3), demos.size());
  normalizer.apply(pool, demos.states, demos.size(), x);
  Tape<float> tape = network.mlp.make_tape(demos.size());
  network.mlp.forward(theta.data(), x.topRows(3), tape, 0);
  const Matrix<float> error = network.mlp.output(tape, 0, demos.size()) + 0.5F * demos.states;
  EXPECT_LT(error.squaredNorm(), 0.05F * (0.5F * demos.states).squaredNorm());
}

}  // namespace
}  // namespace agail
