#include "agail/imitation/agail.h"

#include <gtest/gtest.h>

#include "agail/imitation/behavior_cloning.h"
#include "agail/imitation/inverse_dynamics.h"
#include "imitation/support.h"

namespace agail {
namespace {

constexpr Index kSteps = 200;
constexpr std::uint64_t kSeed = 5;

Settings small_settings() {
  Settings settings;
  settings.discriminator.hidden = {16, 16};
  settings.discriminator.minibatches = 3;
  settings.discriminator.minibatch = 50;
  settings.discriminator.every = 2;
  settings.discriminator.gradient_penalty = 0.5;
  settings.guide.hidden = 8;
  settings.reward.centring = 0.5;
  return settings;
}

// Batches of a random policy, and what a method makes of them.
struct Outcome {
  std::vector<Vector<float>> rewards;
  TensorStore state;
  bool has_guide = false;
  double beta = 0;
};

Outcome run(const std::string& method, const Demonstrations& demonstrations, const std::string& id,
            const Settings& settings, int threads = 1) {
  const EnvironmentSpec spec = environment_spec(id);
  ThreadPool pool(threads);
  const DemoData demos(demonstrations);
  const PolicyNetwork<float> network(spec.observation_dim, {8}, spec.action);
  const Vector<float> theta = reference::normal_vector(network.parameters(), 1, 0.2).cast<float>();
  Normalizer normalizer(spec.observation_dim, true, 5);
  Collector collector(id, 2, kSeed, pool);
  Batch batch(spec.observation_dim, spec.action.dim, 2, kSteps / 2);
  Stopwatch stopwatch;
  AdversarialReward reward(method, demos, spec.action, demonstrations.missing_ratio(), settings,
                           pool, kSteps, kSeed);
  Outcome result;
  result.has_guide = reward.has_guide();
  result.beta = reward.beta();
  for (std::uint32_t update = 0; update < 5; ++update) {
    collector.collect(network, theta, normalizer, batch, stopwatch);
    Vector<float> rewards = Vector<float>::Zero(kSteps);
    const ImitationReport report =
        reward.update(batch, {network, theta, normalizer}, update, rewards, stopwatch);
    EXPECT_EQ(report.discriminator.has_value(), update % 2 == 0);
    EXPECT_EQ(report.has_guide, reward.has_guide());
    EXPECT_TRUE(rewards.allFinite());
    result.rewards.push_back(rewards);
    normalizer.update(pool, batch.observations);
  }
  result.state = archived(reward);
  return result;
}

bool same(const Outcome& a, const Outcome& b) {
  bool equal = a.rewards.size() == b.rewards.size() && same_store(a.state, b.state);
  for (std::size_t i = 0; equal && i < a.rewards.size(); ++i)
    equal = reference::same_bits(a.rewards[i], b.rewards[i]);
  return equal;
}

class AgailTest : public testing::TestWithParam<std::string> {
 protected:
  static Demonstrations demonstrations(MaskPattern pattern, double ratio) {
    Demonstrations demos = random_demonstrations(GetParam(), 12, 3);
    remove_actions(demos, {.pattern = pattern, .ratio = ratio, .seed = 4, .dimension = {}});
    return demos;
  }
};

// What stands in a missing entry changes no bit of anything that is learned.
TEST_P(AgailTest, MissingActionsAreNeverRead) {
  const EnvironmentSpec spec = environment_spec(GetParam());
  for (const MaskPattern pattern : {MaskPattern::kStep, MaskPattern::kDimension}) {
    if (spec.action.discrete && pattern == MaskPattern::kDimension) continue;
    Demonstrations demos = demonstrations(pattern, 0.5);
    for (const std::string method : {"agail", "agail nearest", "agail own", "gail"}) {
      if (method == "gail" && pattern == MaskPattern::kDimension) continue;  // no complete step
      Settings settings = small_settings();
      if (method.size() > 6) settings.guide.target = method.substr(6);
      std::vector<Outcome> runs;
      for (const double poison : kPoison) {
        fill_missing(demos, poison);
        runs.push_back(run(method.substr(0, method.find(' ')), demos, GetParam(), settings));
        EXPECT_EQ(runs.back().has_guide, method != "gail");
        EXPECT_TRUE(same(runs.back(), runs.front())) << method << " with " << poison;
      }
    }
    // Cloning and inverse dynamics.
    std::vector<Vector<float>> cloned;
    std::vector<Matrix<float>> inferred;
    for (const double poison : kPoison) {
      fill_missing(demos, poison);
      const DemoData data(demos);
      ThreadPool pool(1);
      const PolicyNetwork<float> network(spec.observation_dim, {8}, spec.action);
      const Normalizer identity(spec.observation_dim, false, 5);
      Vector<float> theta = reference::normal_vector(network.parameters(), 1, 0.1).cast<float>();
      BcSettings settings;
      settings.epochs = 3;
      const CloningTargets targets{data.actions, data.available, data.some_action};
      clone_policy(network, identity, data, targets, settings, true, pool, 1, theta);
      EXPECT_TRUE(theta.allFinite());
      cloned.push_back(theta);
      CloningTerm term(network, identity, data, targets, {.weight = 1, .decay = 1, .minibatch = 64},
                       pool, 1);
      term.begin_update(theta);
      Vector<float> gradient = Vector<float>::Zero(theta.size());
      term.add_gradient(theta, gradient);
      cloned.push_back(gradient);
      inferred.emplace_back();
      Matrix<float> available;
      infer_missing_actions(data, spec.action, {.hidden = {8}, .epochs = 3}, 5, pool, 1,
                            inferred.back(), available);
      EXPECT_TRUE(inferred.back().allFinite());
      EXPECT_TRUE(reference::same_bits(cloned[cloned.size() - 2], cloned[0]));
      EXPECT_TRUE(reference::same_bits(cloned[cloned.size() - 1], cloned[1]));
      EXPECT_TRUE(reference::same_bits(inferred.back(), inferred.front()));
    }
  }
}

// A known entry, on the other hand, does matter.
TEST_P(AgailTest, AvailableActionsAreRead) {
  Demonstrations demos = demonstrations(MaskPattern::kStep, 0.5);
  Demonstrations other = demos;
  for (DemoEpisode& episode : other.episodes)
    for (Index t = 0; t < episode.steps(); ++t)
      if (episode.available(t, 0) == 1)
        episode.actions(t, 0) =
            demos.action.discrete ? 1 - episode.actions(t, 0) : -episode.actions(t, 0);
  for (const std::string method : {"agail", "gail"})
    EXPECT_FALSE(same(run(method, demos, GetParam(), small_settings()),
                      run(method, other, GetParam(), small_settings())));
  EXPECT_TRUE(same(run("state-gail", demos, GetParam(), small_settings()),
                   run("state-gail", other, GetParam(), small_settings())));
}

TEST_P(AgailTest, WithNothingLeftItIsStateGail) {
  const Demonstrations demos = demonstrations(MaskPattern::kStep, 1);
  ASSERT_EQ(demos.missing_ratio(), 1);
  for (const std::string target : {"random", "nearest", "own"}) {
    Settings settings = small_settings();
    settings.guide.target = target;
    const Outcome agail = run("agail", demos, GetParam(), settings);
    EXPECT_FALSE(agail.has_guide);
    EXPECT_EQ(agail.beta, 0);
    EXPECT_TRUE(same(agail, run("state-gail", demos, GetParam(), settings)));
    settings.reward.beta = 0.7;  // even where the weight is given
    EXPECT_TRUE(same(agail, run("agail", demos, GetParam(), settings)));
  }
  EXPECT_THROW(run("gail", demos, GetParam(), small_settings()), InputError);
}

TEST_P(AgailTest, BetaIsTheShareOfKnownActions) {
  EXPECT_EQ(run("agail", demonstrations(MaskPattern::kStep, 0), GetParam(), small_settings()).beta,
            1);
  const Demonstrations some = demonstrations(MaskPattern::kStep, 0.25);
  const Outcome quarter = run("agail", some, GetParam(), small_settings());
  EXPECT_EQ(quarter.beta, 1 - some.missing_ratio());
  EXPECT_NEAR(quarter.beta, 0.75, 0.03);
  Settings settings = small_settings();
  settings.reward.beta = 0;
  const Outcome none = run("agail", some, GetParam(), settings);
  EXPECT_FALSE(none.has_guide);
  EXPECT_TRUE(same(none, run("state-gail", some, GetParam(), settings)));
}

// r = alpha r_D + beta r_Q - centring * running mean, from runs that have one part each.
TEST_P(AgailTest, RewardIsTheWeightedSum) {
  const Demonstrations demos = demonstrations(MaskPattern::kStep, 0.5);
  const auto rewards = [&](double alpha, double beta, double centring) {
    Settings settings = small_settings();
    settings.reward.alpha = alpha;
    settings.reward.beta = beta;
    settings.reward.centring = centring;
    return run("agail", demos, GetParam(), settings).rewards;
  };
  const auto d = rewards(1, 0, 0), q = rewards(0, 1, 0), both = rewards(0.5, 0.25, 0),
             centred = rewards(0.5, 0.25, 0.8);
  double mean = 0;
  for (std::size_t i = 0; i < both.size(); ++i) {
    EXPECT_LE((0.5F * d[i] + 0.25F * q[i] - both[i]).cwiseAbs().maxCoeff(), 1e-6);
    mean += (static_cast<double>(both[i].mean()) - mean) / static_cast<double>(i + 1);
    EXPECT_LE(
        (both[i].array() - static_cast<float>(0.8 * mean) - centred[i].array()).abs().maxCoeff(),
        1e-5);
  }
}

TEST_P(AgailTest, SameBitsForAnyNumberOfThreads) {
  const Demonstrations demos = demonstrations(MaskPattern::kStep, 0.5);
  for (const std::string target : {"random", "nearest"}) {
    Settings settings = small_settings();
    settings.guide.target = target;
    const Outcome first = run("agail", demos, GetParam(), settings, 1);
    EXPECT_TRUE(same(first, run("agail", demos, GetParam(), settings, 2)));
    EXPECT_TRUE(same(first, run("agail", demos, GetParam(), settings, 3)));
  }
}

INSTANTIATE_TEST_SUITE_P(Environments, AgailTest, testing::Values("CartPole-v1", "Hopper-v5"),
                         [](const auto& test) {
                           return test.param.substr(0, test.param.find('-'));
                         });

}  // namespace
}  // namespace agail
