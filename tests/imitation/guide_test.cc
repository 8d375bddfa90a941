#include "agail/imitation/guide.h"

#include <gtest/gtest.h>

#include "imitation/support.h"

namespace agail {
namespace {

using reference::numbers;
using reference::relative_error;

struct Case {
  bool discrete, sees_action, masked;
};

constexpr int kObservations = 3;

class GuideNetworkTest : public testing::TestWithParam<Case> {
 protected:
  static constexpr Index kHidden = 4, kSamples = 100;
  GuideNetworkTest()
      : space_(GetParam().discrete ? discrete_actions(3) : continuous_actions(2)),
        network_(kObservations, space_, kHidden, GetParam().sees_action),
        theta_(network_.parameters()),
        x_(reference::network_input(network_.mlp.inputs(), kSamples, 2)),
        targets_(random_actions(space_, kSamples, 3)),
        available_(Matrix<double>::Ones(space_.dim, kSamples)) {
    RandomStream random(1, Purpose::kInitialise);
    network_.initialise(theta_.data(), random);
    cross_ = theta_.head(first_layer()).array() == 0;
    // Everything moves but what separates the first layer.
    for (Index k = 0; k < theta_.size(); ++k)
      if (k >= first_layer() || !cross_[k]) theta_[k] += 0.4 * random.normal();
    if (GetParam().masked)
      for (Index j = 0; j < kSamples; ++j)
        for (Index i = 0; i < space_.dim; ++i)
          if ((i + j) % 3 == 0) {
            available_(i, j) = 0;
            targets_(i, j) = GetParam().discrete ? 0 : 1e30;
          }
  }
  Index first_layer() const { return network_.mlp.sizes()[1] * network_.mlp.inputs(); }

  template <class T>
  T reference_loss(const reference::Numbers<T>& theta) const {
    T sum(0.0);
    for (Index j = 0; j < kSamples; ++j) {
      const auto x = reference::convert<T>(numbers(x_.col(j).head(network_.mlp.inputs())));
      sum = sum - reference::log_prob(
                      space_.discrete,
                      reference::mlp(network_.mlp.sizes(), Activation::kLeakyRelu, theta.data(), x),
                      theta.data() + network_.mlp.parameters(), numbers(targets_.col(j)),
                      numbers(available_.col(j)));
    }
    return sum / T(static_cast<double>(kSamples));
  }

  ActionSpace space_;
  GuideNetwork<double> network_;
  Vector<double> theta_;
  Matrix<double> x_, targets_, available_;
  Eigen::Array<bool, Eigen::Dynamic, 1> cross_;  // weights that separate s from a
};

TEST_P(GuideNetworkTest, LossAndGradient) {
  ThreadPool pool(1);
  ChunkSums<double> sums(network_.parameters() + 1, kSamples);
  std::vector<Scratch<double>> scratch{network_.mlp.make_scratch()};
  const auto loss = [&](const Vector<double>& theta, Vector<double>& gradient) {
    return network_.loss(pool, sums, scratch, theta, x_, targets_, available_, kSamples, gradient);
  };
  Vector<double> gradient(theta_.size()), ignored(theta_.size());
  EXPECT_NEAR(loss(theta_, gradient), reference_loss(numbers(theta_)), 1e-12);
  // The weights that separate do not learn: their slope is not part of the gradient.
  const auto kept = [&](Vector<double> slope) {
    for (Index k = 0; k < first_layer(); ++k)
      if (cross_[k]) slope[k] = 0;
    return slope;
  };
  const auto f = [&](const auto& theta) { return reference_loss(theta); };
  EXPECT_LE(relative_error(gradient, kept(reference::gradient(f, theta_))), 1e-11);
  const auto value = [&](const Vector<double>& theta) { return loss(theta, ignored); };
  EXPECT_LE(relative_error(gradient, kept(reference::differences(value, theta_))), 1e-7);
}

TEST_P(GuideNetworkTest, FirstLayerStaysSeparated) {
  ThreadPool pool(1);
  ChunkSums<double> sums(network_.parameters() + 1, kSamples);
  std::vector<Scratch<double>> scratch{network_.mlp.make_scratch()};
  Adam<double> adam(theta_.size());
  Vector<double> gradient(theta_.size());
  double first = 0, last = 0;
  for (int step = 0; step < 100; ++step) {
    last = network_.loss(pool, sums, scratch, theta_, x_, targets_, available_, kSamples, gradient);
    if (step == 0) first = last;
    adam.descend(pool, theta_, gradient, 1e-2);
  }
  EXPECT_LT(last, first);
  // [s; a] -> units of s, units of a: zero where s meets the units of a, and the other way round.
  const Index units = network_.mlp.sizes()[1];
  const Eigen::Map<const Matrix<double>> w(theta_.data(), units, network_.mlp.inputs());
  for (Index unit = 0; unit < units; ++unit)
    for (Index input = 0; input < network_.mlp.inputs(); ++input) {
      const bool crosses =
          GetParam().sees_action && ((unit < units / 2) != (input < kObservations));
      EXPECT_EQ(w(unit, input) == 0, crosses);
    }
}

INSTANTIATE_TEST_SUITE_P(Networks, GuideNetworkTest,
                         testing::Values(Case{false, true, false}, Case{false, true, true},
                                         Case{false, false, true}, Case{true, true, false},
                                         Case{true, true, true}, Case{true, false, true}));

// Small problems whose best guide is known. The demonstrator's action depends on the state, the
// policy's action is drawn without regard to it; the best Q is the demonstrator's distribution at
// s, whatever the policy did.
class GuideTest : public testing::TestWithParam<std::string> {
 protected:
  static constexpr Index kDemos = 8000, kStates = 3;

  GuideSettings settings(const std::string& reward) const {
    GuideSettings result;
    result.target = GetParam();
    result.reward = reward;
    result.hidden = 24;
    result.learning_rate = 3e-3;
    return result;
  }

  void train(Guide& guide, const PolicyView& policy, std::uint32_t updates = 150) const {
    for (std::uint32_t update = 0; update < updates; ++update) guide.learn(policy, 8, update);
  }

  ThreadPool pool_{1};
};

constexpr double kTable[3][3] = {{0.7, 0.2, 0.1}, {0.1, 0.3, 0.6}, {0.25, 0.5, 0.25}};

TEST_P(GuideTest, LearnsATableOfActions) {
  const ActionSpace space = discrete_actions(3);
  RandomStream random(1, Purpose::kRecord);
  Matrix<double> states = Matrix<double>::Zero(kStates, kDemos + 1), actions(1, kDemos);
  Matrix<double> counts = Matrix<double>::Zero(kStates, 3);
  states(0, kDemos) = 1;
  for (Index j = 0; j < kDemos; ++j) {
    const Index s = random.below(3);
    const double u = random.uniform();
    const Index a = u < kTable[s][0] ? 0 : u < kTable[s][0] + kTable[s][1] ? 1 : 2;
    states(s, j) = 1;
    actions(0, j) = static_cast<double>(a);
    counts(s, a) += 1;
  }
  Demonstrations demonstrations = demonstrations_from(states, actions, space);
  // Half of them missing must not move the answer.
  remove_actions(demonstrations,
                 {.pattern = MaskPattern::kStep, .ratio = 0.5, .seed = 1, .dimension = {}});
  const DemoData demos(demonstrations);
  const PolicyNetwork<float> network(kStates, {8}, space);
  Vector<float> theta(network.parameters());
  RandomStream start(2, Purpose::kInitialise);
  network.initialise(theta.data(), start, 0);
  const Normalizer identity(kStates, false, 5);
  const PolicyView policy{network, theta, identity};

  // 200 samples of each state and action.
  constexpr Index kEach = 200, kSamples = 9 * kEach;
  Matrix<float> visited = Matrix<float>::Zero(kStates, kSamples), acted(1, kSamples);
  for (Index j = 0; j < kSamples; ++j) {
    visited(j / (3 * kEach), j) = 1;
    acted(0, j) = static_cast<float>(j / kEach % 3);
  }
  for (const std::string reward : {"log-likelihood", "likelihood"}) {
    Guide guide(demos, space, settings(reward), 128, 5, pool_, 1);
    train(guide, policy);
    // Adam's steps keep moving it around the optimum: the mean over some updates.
    constexpr std::uint32_t kAveraged = 40;
    Vector<float> rewards = Vector<float>::Zero(kSamples), now(kSamples);
    for (std::uint32_t update = 200; update < 200 + kAveraged; ++update) {
      guide.learn(policy, 8, update);
      guide.rewards(visited, acted, kSamples, update, now);
      rewards += now / static_cast<float>(kAveraged);
    }
    GuideReport report;
    guide.diagnose(policy, visited, kSamples, 0, report);

    // E log Q on held-out actions: minus the demonstrator's entropy.
    double entropy = 0;
    for (const auto& probabilities : kTable)
      for (const double p : probabilities) entropy -= p * std::log(p) / 3;
    EXPECT_NEAR(report.held_out_log_likelihood, -entropy, 0.1);

    const auto value = [&](double p) { return reward == "likelihood" ? p : std::log(p); };
    for (Index s = 0; s < kStates; ++s) {
      double any = 0;  // a_E drawn from all demonstrations, asked at s
      for (Index a = 0; a < 3; ++a) any += counts.col(a).sum() / kDemos * value(kTable[s][a]);
      for (Index a = 0; a < 3; ++a) {
        const auto block = rewards.segment((3 * s + a) * kEach, kEach).cast<double>();
        if (GetParam() == "own") {
          EXPECT_NEAR(block[0], value(kTable[s][a]), reward == "likelihood" ? 0.03 : 0.15);
          EXPECT_EQ(block.minCoeff(), block.maxCoeff());
        } else if (GetParam() == "random") {
          EXPECT_NEAR(block.mean(), any, 0.12) << "state " << s << " action " << a;
        } else {
          // Many demonstrations lie at distance zero; the tree takes one of them, always the same.
          EXPECT_EQ(block.minCoeff(), block.maxCoeff());
          double nearest = 1;
          for (Index k = 0; k < 3; ++k)
            nearest = std::min(nearest, std::abs(block[0] - value(kTable[s][k])));
          EXPECT_LE(nearest, 0.12);
        }
      }
    }
    if (GetParam() == "own")
      EXPECT_GT(report.action_variance_share, 0.5);
    else
      EXPECT_LT(report.action_variance_share, 0.05);
  }
}

// a_E = 0.8 s + 0.3 with deviation 0.2.
TEST_P(GuideTest, LearnsALinearGaussian) {
  const ActionSpace space = continuous_actions(1);
  RandomStream random(1, Purpose::kRecord);
  Matrix<double> states(1, kDemos + 1), actions(1, kDemos);
  for (Index j = 0; j <= kDemos; ++j) {
    states(0, j) = random.uniform(-1, 1);
    if (j < kDemos) actions(0, j) = 0.8 * states(0, j) + 0.3 + 0.2 * random.normal();
  }
  const DemoData demos(demonstrations_from(states, actions, space));
  const PolicyNetwork<float> network(1, {8}, space);
  Vector<float> theta(network.parameters());
  RandomStream start(2, Purpose::kInitialise);
  network.initialise(theta.data(), start, 0);  // actions: standard normal
  const Normalizer identity(1, false, 5);
  const PolicyView policy{network, theta, identity};
  const auto density = [](double a, double s) {
    const double z = (a - 0.8 * s - 0.3) / 0.2;
    return -0.5 * z * z - std::log(0.2) - 0.5 * std::log(2 * std::numbers::pi);
  };

  Guide guide(demos, space, settings("log-likelihood"), 128, 5, pool_, 1);
  train(guide, policy);
  // Visited: the demonstrated states themselves, with actions near the demonstrator's.
  Matrix<float> acted(1, kDemos);
  for (Index j = 0; j < kDemos; ++j)
    acted(0, j) = static_cast<float>(0.8 * states(0, j) + 0.3 + 0.2 * random.normal());
  Vector<float> rewards(kDemos), again(kDemos);
  guide.rewards(demos.states, acted, kDemos, 7, rewards);
  GuideReport report;
  guide.diagnose(policy, demos.states, kDemos, 0, report);
  const double entropy = std::log(0.2) + 0.5 * std::log(2 * std::numbers::pi * std::numbers::e);
  EXPECT_NEAR(report.held_out_log_likelihood, -entropy, 0.15);

  double mean = 0, expected = 0;
  Index compared = 0, close = 0;
  for (Index j = 0; j < kDemos; ++j) {
    const auto s = states(0, j);
    mean += static_cast<double>(rewards[j]) / kDemos;
    if (GetParam() == "own") {
      expected += density(static_cast<double>(acted(0, j)), s) / kDemos;
      EXPECT_NEAR(rewards[j], density(static_cast<double>(acted(0, j)), s), 1.2);
    } else if (GetParam() == "nearest") {
      // Nine in ten are the demonstration's own action; the others were held out, and their
      // neighbour's counts.
      const double own = density(actions(0, j), s);
      expected += own / kDemos;
      ++compared;
      close += std::abs(static_cast<double>(rewards[j]) - own) < 0.3 ? 1 : 0;
    } else {
      for (Index k = j % 40; k < kDemos; k += 40)
        expected += density(actions(0, k), s) * 40 / kDemos / kDemos;
    }
  }
  EXPECT_NEAR(mean, expected, GetParam() == "random" ? 0.1 * std::abs(expected) : 0.1);
  if (GetParam() == "nearest") {
    EXPECT_GT(static_cast<double>(close), 0.85 * static_cast<double>(compared));
  }
  // What the policy does matters to `own` alone.
  acted.setConstant(0.9F);
  guide.rewards(demos.states, acted, kDemos, 7, again);
  const double change = static_cast<double>((again - rewards).cwiseAbs().mean());
  const double spread =
      std::sqrt(static_cast<double>((rewards.array() - rewards.mean()).square().mean()));
  if (GetParam() == "own") {
    EXPECT_GT(change, 1);
    EXPECT_GT(report.action_variance_share, 0.5);
  } else {
    EXPECT_LT(change, 0.1 * spread);
    EXPECT_LT(report.action_variance_share, 0.05);
  }
}

// exp(-z^2 / 2) against the log-density of the same network.
TEST_P(GuideTest, LikelihoodIsTheDensityOverItsPeak) {
  const ActionSpace space = continuous_actions(1);
  const Matrix<double> states = reference::normal_matrix(1, 201, 1);
  const DemoData demos(demonstrations_from(states, reference::normal_matrix(1, 200, 2), space));
  const PolicyNetwork<float> network(1, {8}, space);
  const Vector<float> theta = Vector<float>::Zero(network.parameters());
  const Normalizer identity(1, false, 5);
  const Matrix<float> acted = reference::normal_matrix(1, 200, 3).cast<float>();
  const auto rewards = [&](const std::string& form) {
    Guide guide(demos, space, settings(form), 64, 5, pool_, 1);
    guide.learn({network, theta, identity}, 8, 0);
    Vector<float> result(200);
    guide.rewards(demos.states, acted, 200, 3, result);
    return result;
  };
  const Vector<float> likelihood = rewards("likelihood"), log_density = rewards("log-likelihood");
  EXPECT_LE(likelihood.maxCoeff(), 1);
  EXPECT_GT(likelihood.minCoeff(), 0);
  const Eigen::ArrayXd constant =
      likelihood.cast<double>().array().log() - log_density.cast<double>().array();
  EXPECT_NEAR(constant.maxCoeff(), constant.minCoeff(), 1e-4);
  // log_std has moved from 0 by at most 8 steps of 3e-3.
  EXPECT_NEAR(constant.mean(), 0.5 * std::log(2 * std::numbers::pi), 0.03);
}

TEST_P(GuideTest, SameBitsForAnyNumberOfThreadsAndFromAnArchive) {
  const ActionSpace space = continuous_actions(2, 1);
  const DemoData demos(demonstrations_from(reference::normal_matrix(3, 301, 1),
                                           reference::normal_matrix(2, 300, 2), space));
  const PolicyNetwork<float> network(3, {8}, space);
  const Vector<float> theta = reference::normal_vector(network.parameters(), 3, 0.3).cast<float>();
  const Normalizer identity(3, false, 5);
  const PolicyView policy{network, theta, identity};
  const Matrix<float> acted = reference::normal_matrix(2, 300, 3).cast<float>();
  Vector<float> first;
  for (const int threads : {1, 2, 3}) {
    ThreadPool pool(threads);
    Guide guide(demos, space, settings("likelihood"), 100, 5, pool, 1);
    guide.learn(policy, 3, 0);
    TensorStore store = archived(guide);
    Guide resumed(demos, space, settings("likelihood"), 100, 5, pool, 1);
    Archive load(store, Archive::Mode::kLoad);
    resumed.archive(load);
    GuideReport report;
    resumed.diagnose(policy, demos.states, 300, 1, report);  // disturbs nothing
    Vector<float> rewards(300), same(300);
    guide.learn(policy, 3, 1);
    guide.rewards(demos.states, acted, 300, 1, rewards);
    resumed.learn(policy, 3, 1);
    resumed.rewards(demos.states, acted, 300, 1, same);
    EXPECT_TRUE(same_store(archived(guide), archived(resumed)));
    EXPECT_TRUE(reference::same_bits(rewards, same));
    if (threads == 1) first = rewards;
    EXPECT_TRUE(reference::same_bits(rewards, first));
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, GuideTest, testing::Values("own", "random", "nearest"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace agail
