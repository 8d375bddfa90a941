#include "agail/train/evaluation.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "agail/base/interrupt.h"
#include "agail/comm/collectives.h"
#include "agail/comm/pack.h"

namespace agail {

namespace {

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

// What the episodes of one evaluation have in common.
struct Play {
  std::uint64_t seed;
  Purpose purpose;
  bool stochastic, stops_on_signals;
};

// Runs episode `episode` of `policy`; on_step(action, result) after each step, with the environment
// after it.
template <class OnReset, class OnStep>
void run_episode(const SavedPolicy& policy, Environment& environment,
                 SavedPolicy::Workspace& workspace, const Play& play, std::uint32_t episode,
                 OnReset&& on_reset, OnStep&& on_step) {
  RandomStream reset(play.seed, play.purpose, 0, episode);
  environment.reset(reset);
  on_reset();
  std::vector<float> action(static_cast<std::size_t>(policy.action().dim));
  for (bool done = false; !done;) {
    if (play.stops_on_signals && interrupted() != 0) throw EpisodesInterrupted{interrupted()};
    RandomStream random(play.seed, play.purpose, 1, episode,
                        static_cast<std::uint32_t>(environment.elapsed_steps()));
    policy.act(environment.observation(), play.stochastic ? &random : nullptr, workspace,
               action.data());
    const StepResult result = environment.step(action);
    on_step(action, result);
    done = result.terminated || result.truncated;
  }
}

struct Actor {
  std::unique_ptr<Environment> environment;
  SavedPolicy::Workspace workspace;
};

std::vector<Actor> make_actors(const SavedPolicy& policy, const ThreadPool& pool) {
  std::vector<Actor> actors;
  for (int i = 0; i < pool.threads(); ++i) {
    actors.push_back({make_environment(policy.info().environment), policy.make_workspace()});
    const EnvironmentSpec& spec = actors.back().environment->spec();
    if (spec.observation_dim != policy.observation_dim() ||
        spec.action.dim != policy.action().dim || spec.action.n != policy.action().n)
      throw InputError("the policy does not fit " + spec.id + ": it was trained with " +
                       sizes_in_words(policy.observation_dim(), policy.action()) +
                       ", the environment has " +
                       sizes_in_words(spec.observation_dim, spec.action) +
                       "; give the environment as it was then");
  }
  return actors;
}

// Completes what every rank knows of its share of the episodes.
void gather_episodes(Team team, std::vector<double>& returns, std::vector<double>& lengths,
                     std::vector<std::uint8_t>& diverged) {
  const auto share = [&](int rank) {
    return share_of(static_cast<std::ptrdiff_t>(returns.size()), team.ranks(), rank);
  };
  const auto for_each_array = [&](const Share& s, auto&& visit) {
    const auto count = static_cast<std::size_t>(s.size());
    visit(returns.data() + s.begin, count);
    visit(lengths.data() + s.begin, count);
    visit(diverged.data() + s.begin, count);
  };
  Bytes message;
  Packer pack(message);
  for_each_array(share(team.rank()),
                 [&](auto* values, std::size_t count) { pack.array(values, count); });
  Blocks all;
  allgather(team.communicator(), message, all);
  for (int r = 0; r < team.ranks(); ++r) {
    Unpacker unpack(all[r]);
    for_each_array(share(r), [&](auto* values, std::size_t count) { unpack.array(values, count); });
  }
}

}  // namespace

double Evaluation::mean_return() const { return mean(returns); }
double Evaluation::mean_length() const { return mean(lengths); }

double Evaluation::standard_error() const {
  const auto n = static_cast<double>(returns.size());
  if (n < 2) return 0;
  const double mean = mean_return();
  double squares = 0;
  for (const double r : returns) squares += (r - mean) * (r - mean);
  return std::sqrt(squares / (n - 1) / n);
}

std::pair<double, double> bootstrap_interval(const std::vector<double>& values,
                                             std::uint64_t seed) {
  constexpr std::size_t kResamples = 10'000;
  constexpr std::size_t kOneStream = 6'000;  // so many values resampled fit into its 2^26 numbers
  RandomStream random(seed, Purpose::kBootstrap);
  std::vector<double> means(kResamples);
  std::uint32_t number = 0;
  for (double& m : means) {
    if (values.size() > kOneStream) random = RandomStream(seed, Purpose::kBootstrap, ++number);
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += values[random.below(static_cast<std::uint32_t>(values.size()))];
    m = sum / static_cast<double>(values.size());
  }
  std::sort(means.begin(), means.end());
  return {means[kResamples * 25 / 1000], means[kResamples * 975 / 1000 - 1]};
}

Evaluation evaluate(const SavedPolicy& policy, Index episodes, std::uint64_t seed, bool stochastic,
                    Team team, bool stops_on_signals) {
  std::vector<Actor> actors = make_actors(policy, team.pool());
  const auto n = static_cast<std::size_t>(episodes);
  std::vector<double> returns(n), lengths(n);
  std::vector<std::uint8_t> diverged(n);
  const Share own = share_of(episodes, team.ranks(), team.rank());
  const Play play{seed, Purpose::kEvaluate, stochastic, stops_on_signals};
  team.pool().run(static_cast<int>(own.size()), [&](int task, int worker) {
    Actor& actor = actors[static_cast<std::size_t>(worker)];
    const auto e = static_cast<std::size_t>(own.begin + task);
    run_episode(
        policy, *actor.environment, actor.workspace, play, static_cast<std::uint32_t>(e), [] {},
        [&](const std::vector<float>&, const StepResult& result) {
          returns[e] += result.reward;
          lengths[e] += 1;
          if (result.diverged) diverged[e] = 1;
        });
  });
  if (team.ranks() > 1) gather_episodes(team, returns, lengths, diverged);
  Evaluation evaluation{std::move(returns), std::move(lengths), 0};
  for (const std::uint8_t d : diverged) evaluation.diverged += d;
  return evaluation;
}

Demonstrations record(const SavedPolicy& policy, Index episodes, std::uint64_t seed,
                      bool stochastic, ThreadPool& pool, bool stops_on_signals) {
  std::vector<Actor> actors = make_actors(policy, pool);
  const EnvironmentSpec& spec = actors.front().environment->spec();
  Demonstrations demos;
  demos.environment = spec.id;
  demos.action = spec.action;
  demos.observation_dim = spec.observation_dim;
  demos.observations_are_float32 = spec.observation_is_float32;
  demos.episodes.resize(static_cast<std::size_t>(episodes));
  const Play play{seed, Purpose::kRecord, stochastic, stops_on_signals};
  pool.run(static_cast<int>(episodes), [&](int index, int worker) {
    Actor& actor = actors[static_cast<std::size_t>(worker)];
    DemoEpisode& episode = demos.episodes[static_cast<std::size_t>(index)];
    std::vector<double> observations;
    std::vector<double> actions;
    const auto observe = [&] {
      const std::span<const double> o = actor.environment->observation();
      observations.insert(observations.end(), o.begin(), o.end());
    };
    run_episode(policy, *actor.environment, actor.workspace, play,
                static_cast<std::uint32_t>(index), observe,
                [&](const std::vector<float>& action, const StepResult& result) {
                  observe();
                  actions.insert(actions.end(), action.begin(), action.end());
                  episode.rewards.push_back(result.reward);
                  episode.terminations.push_back(result.terminated ? 1 : 0);
                  episode.truncations.push_back(result.truncated ? 1 : 0);
                });
    const auto steps = static_cast<Index>(episode.rewards.size());
    episode.observations =
        Eigen::Map<const RowMatrix<double>>(observations.data(), steps + 1, spec.observation_dim);
    episode.actions = Eigen::Map<const RowMatrix<double>>(actions.data(), steps, spec.action.dim);
    episode.available = RowMatrix<std::uint8_t>::Ones(steps, spec.action.dim);
  });
  return demos;
}

}  // namespace agail
