#include "agail/train/trainer.h"

#include <gtest/gtest.h>

#include "imitation/support.h"

namespace agail {
namespace {

TrainingTask task(const std::string& environment, const std::string& method, int threads = 1) {
  TrainingTask result;
  result.environment = environment;
  result.method = method;
  result.seed = 3;
  result.threads = threads;
  Settings& s = result.settings;
  s.run.batch_steps = 300;
  s.run.lanes = 3;
  s.policy.hidden = {16};
  s.value.hidden = {16};
  s.value.normalize_targets = true;
  s.discriminator.hidden = {16};
  s.discriminator.minibatches = 3;
  s.discriminator.minibatch = 100;
  s.discriminator.every = 2;
  s.discriminator.gradient_penalty = 0.1;
  s.guide.hidden = 8;
  s.reward.centring = 1;
  s.bc.epochs = 3;
  s.inverse_dynamics.epochs = 3;
  s.inverse_dynamics.hidden = {16};
  s.bco.every = 2;
  s.bco.buffer = 700;  // less than the batches together: the ring wraps
  s.bco.epochs = 2;
  return result;
}

Demonstrations masked(const std::string& environment, double ratio) {
  Demonstrations demos = random_demonstrations(environment, 15, 3);
  remove_actions(demos,
                 {.pattern = MaskPattern::kStep, .ratio = ratio, .seed = 4, .dimension = {}});
  return demos;
}

struct Trained {
  TensorStore policy, state;
};

Trained train(TrainingTask t, int updates = 4) {
  Trainer trainer(std::move(t));
  for (int i = 0; i < updates && trainer.learns_by_interaction(); ++i) {
    const UpdateReport report = trainer.update();
    EXPECT_TRUE(!report.trpo || report.trpo->accepted);
  }
  return {trainer.policy().store(), archived(trainer)};
}

// Equal but for the method's name.
bool same(const Trained& a, const Trained& b) {
  TensorStore x = a.policy, y = b.policy;
  EXPECT_FALSE(x.tensors.empty());
  for (TensorStore* store : {&x, &y}) {
    EXPECT_EQ(store->metadata.count("method"), 1U);
    store->metadata.erase("method");
  }
  return same_store(x, y) && same_store(a.state, b.state);
}

class TrainerTest : public testing::TestWithParam<std::string> {};

TEST_P(TrainerTest, WithAllActionsMissingAgailIsStateGail) {
  for (const std::string start : {"random", "clone-inferred"}) {
    TrainingTask agail = task(GetParam(), "agail"), state_gail = task(GetParam(), "state-gail");
    agail.settings.start.method = state_gail.settings.start.method = start;
    agail.settings.clone.weight = state_gail.settings.clone.weight = start == "random" ? 0 : 0.1;
    agail.demonstrations = state_gail.demonstrations = masked(GetParam(), 1);
    EXPECT_TRUE(same(train(agail), train(state_gail)));
    // And with actions there, state-gail does not see them.
    state_gail.demonstrations = masked(GetParam(), 0.4);
    EXPECT_TRUE(same(train(agail), train(state_gail)));
    agail.demonstrations = masked(GetParam(), 0.4);
    EXPECT_FALSE(same(train(agail), train(state_gail)));
  }
}

TEST_P(TrainerTest, MissingActionsAreNeverRead) {
  for (const std::string method : {"agail", "gail", "bc", "bco"}) {
    std::vector<Trained> runs;
    for (const double poison : kPoison) {
      TrainingTask t = task(GetParam(), method);
      t.settings.start.method = "clone-inferred";
      t.settings.clone.weight = 0.1;
      t.demonstrations = masked(GetParam(), 0.5);
      fill_missing(*t.demonstrations, poison);
      runs.push_back(train(std::move(t), 2));
      EXPECT_TRUE(same(runs.back(), runs.front())) << method << " with " << poison;
    }
  }
}

TEST_P(TrainerTest, SameBitsForAnyNumberOfThreads) {
  for (const std::string method : {"agail", "trpo", "bco"}) {
    std::vector<Trained> runs;
    for (const int threads : {1, 2, 3}) {
      TrainingTask t = task(GetParam(), method, threads);
      t.settings.start.method = "clone";
      if (method != "trpo") t.demonstrations = masked(GetParam(), 0.5);
      runs.push_back(train(std::move(t)));
      EXPECT_TRUE(same(runs.back(), runs.front())) << threads;
    }
  }
}

TEST_P(TrainerTest, ContinuesFromAnArchive) {
  for (const std::string method : {"agail", "gail", "trpo", "bco"}) {
    TrainingTask t = task(GetParam(), method);
    t.settings.start.method = "clone-inferred";
    t.settings.start.value_warmup = 1;
    t.settings.clone.weight = 0.1;
    t.settings.clone.decay = 0.9;
    if (method != "trpo") t.demonstrations = masked(GetParam(), 0.5);
    Trainer whole(t);
    for (int i = 0; i < 3; ++i) whole.update();
    TensorStore store = archived(whole);
    Trainer resumed(t);
    Archive load(store, Archive::Mode::kLoad);
    resumed.archive(load);
    EXPECT_TRUE(same_store(archived(resumed), store));
    for (int i = 0; i < 3; ++i) {
      const UpdateReport a = whole.update(), b = resumed.update();
      EXPECT_EQ(a.timesteps, b.timesteps);
      EXPECT_EQ(a.episodes, b.episodes);
      EXPECT_EQ(a.episode_return, b.episode_return);
      EXPECT_EQ(a.trpo.has_value(), method != "bco");
      if (a.trpo) {
        EXPECT_EQ(a.trpo->kl, b.trpo->kl);
      }
      EXPECT_EQ(a.explained_variance, b.explained_variance);
    }
    EXPECT_TRUE(same_store(archived(whole), archived(resumed))) << method;
    EXPECT_TRUE(same_store(whole.policy().store(), resumed.policy().store()));
  }
}

TEST(CheckSettings, LanesAndFeaturesMustFit) {
  Settings settings;
  settings.run.batch_steps = 512;
  settings.run.lanes = 4;
  settings.discriminator.features = {0, 3};
  check_settings(settings, "CartPole-v1", "agail");
  settings.discriminator.features = {4};
  EXPECT_THROW(check_settings(settings, "CartPole-v1", "agail"), InputError);
  check_settings(settings, "CartPole-v1", "trpo");
  settings.run.lanes = 3;
  EXPECT_THROW(check_settings(settings, "CartPole-v1", "trpo"), InputError);
  TrainingTask lanes = task("CartPole-v1", "trpo");
  lanes.settings.run.lanes = 3;
  lanes.settings.run.batch_steps = 512;
  EXPECT_THROW(Trainer{std::move(lanes)}, InputError);
}

TEST(Divergence, EndsTheRun) {
  for (const std::string method : {"trpo", "state-gail"}) {
    TrainingTask t = task("Hopper-v5", method);
    if (method == "trpo") {
      t.settings.value.learning_rate = 1e30;
    } else {
      t.demonstrations = masked("Hopper-v5", 0.5);
      t.settings.discriminator.learning_rate = 1e39;
    }
    Trainer trainer(std::move(t));
    std::string message;
    try {
      for (int i = 0; i < 5; ++i) trainer.update();
    } catch (const InputError& error) {
      message = error.what();
    }
    EXPECT_NE(message.find("training diverged after"), std::string::npos) << method << message;
    const char* advice = method == "trpo" ? "lower value.learning_rate" : "lower discriminator.";
    EXPECT_NE(message.find(advice), std::string::npos) << message;
  }
}

TEST(ExploringStart, DiscriminatorLearnsFromTheFirstBatchItSees) {
  TrainingTask t = task("Hopper-v5", "agail");
  t.settings.start.method = "clone-inferred";
  t.settings.discriminator.every = 50;
  t.demonstrations = random_demonstrations("Hopper-v5", 15, 3);
  remove_actions(*t.demonstrations,
                 {.pattern = MaskPattern::kDimension, .ratio = 0.34, .seed = 4, .dimension = 1});
  Trainer trainer(std::move(t));
  for (int i = 0; i < 16; ++i) {
    const UpdateReport report = trainer.update();
    EXPECT_EQ(report.imitation.has_value(), i >= 12);
    if (report.imitation) {
      EXPECT_EQ(report.imitation->discriminator.has_value(), i == 12) << i;
      EXPECT_EQ(report.imitation->guide.has_value(), i == 12) << i;
    }
  }
}

TEST(ExploringStart, OwnTransitionsTellADimensionThatNoDemonstrationTells) {
  TrainingTask t = task("Hopper-v5", "agail");
  t.settings.start.method = "clone-inferred";
  t.settings.start.value_warmup = 1;
  t.settings.clone.weight = 0.1;
  t.demonstrations = random_demonstrations("Hopper-v5", 15, 3);
  remove_actions(*t.demonstrations,
                 {.pattern = MaskPattern::kDimension, .ratio = 0.34, .seed = 4, .dimension = 1});
  Trainer whole(t);
  std::vector<TensorStore> stores;
  std::int64_t rounds = 0;
  int first_step = -1;
  constexpr int kUpdates = 16;
  for (int i = 0; i < kUpdates; ++i) {
    stores.push_back(archived(whole));
    const UpdateReport report = whole.update();
    rounds += report.bco.has_value() ? 1 : 0;
    EXPECT_EQ(report.bco.has_value(), first_step < 0 && i % 2 == 1 && i < 12) << i;
    if (report.trpo && first_step < 0) first_step = i;
    EXPECT_EQ(report.clone_log_likelihood.has_value(), report.trpo.has_value());
  }
  EXPECT_EQ(rounds, 6);
  EXPECT_EQ(first_step, 13);  // after the rounds and the value network's own update
  for (const int from : {3, 12, 14}) {
    Trainer resumed(t);
    Archive load(stores[static_cast<std::size_t>(from)], Archive::Mode::kLoad);
    resumed.archive(load);
    for (int i = from; i < kUpdates; ++i) resumed.update();
    EXPECT_TRUE(same_store(archived(whole), archived(resumed))) << from;
  }
}

INSTANTIATE_TEST_SUITE_P(Environments, TrainerTest, testing::Values("CartPole-v1", "Hopper-v5"),
                         [](const auto& test) {
                           return test.param.substr(0, test.param.find('-'));
                         });

}  // namespace
}  // namespace agail
