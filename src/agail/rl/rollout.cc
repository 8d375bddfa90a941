#include "agail/rl/rollout.h"

#include <algorithm>
#include <chrono>
#include <mutex>

namespace agail {

Batch::Batch(int observation_dim, int action_dim, Index lane_count, Index steps_a_lane)
    : lanes(lane_count),
      steps(steps_a_lane),
      observations(Matrix<float>::Zero(observation_dim, size())),
      inputs(Matrix<float>::Zero(padded(observation_dim + 1), size())),
      actions(Matrix<float>::Zero(action_dim, size())),
      rewards(Vector<float>::Zero(size())),
      endings(static_cast<std::size_t>(size())),
      final_observations(Matrix<float>::Zero(observation_dim, size())) {
  finished.reserve(static_cast<std::size_t>(size()));
}

Collector::Collector(const std::string& environment, Index lanes, std::uint64_t seed, Team team)
    : seed_(seed),
      team_(team),
      own_(share_of(lanes, team.ranks(), team.rank())),
      lanes_(static_cast<std::size_t>(lanes)),
      units_(environment_spec(environment).action) {
  if (lanes < team.ranks())
    throw InputError("setting run.lanes = " + std::to_string(lanes) + " is less than the " +
                     std::to_string(team.ranks()) +
                     " ranks, and each needs a lane; start fewer ranks, or give --lanes " +
                     std::to_string(team.ranks()) + " or more");
  for (Index l = own_.begin; l < own_.end; ++l) {
    Lane& lane = lanes_[static_cast<std::size_t>(l)];
    lane.environment = make_environment(environment);
    lane.finished.reserve(4096);
  }
}

void Collector::start_episode(Index index) {
  Lane& lane = lanes_[static_cast<std::size_t>(index)];
  ++lane.episode;
  lane.episode_return = 0;
  RandomStream random(seed_, Purpose::kReset, static_cast<std::uint32_t>(index),
                      static_cast<std::uint32_t>(lane.episode));
  lane.environment->reset(random);
}

template <class Steps>
void Collector::take_turns(Index count, Steps&& steps) {
  const int threads = static_cast<int>(std::min<Index>(team_.pool().threads(), own_.size()));
  const Index turn = threads == 1 ? count : 32;
  const auto lanes = static_cast<std::size_t>(own_.size());
  std::mutex mutex;
  std::size_t next = 0, waiting = lanes;
  turns_.resize(lanes);
  for (std::size_t i = 0; i < lanes; ++i) turns_[i] = {own_.begin + static_cast<Index>(i), 0};
  team_.pool().run(threads, [&](int, int worker) {
    for (;;) {
      Turn mine;
      {
        const std::lock_guard lock(mutex);
        if (waiting == 0) return;
        --waiting;
        mine = turns_[next];
        next = (next + 1) % lanes;
      }
      const Index end = std::min(mine.step + turn, count);
      steps(mine.lane, worker, mine.step, end);
      if (end == count) continue;
      const std::lock_guard lock(mutex);
      turns_[(next + waiting++) % lanes] = {mine.lane, end};
    }
  });
}

void Collector::act(Index index, const PolicyNetwork<float>& network, const Vector<float>& theta,
                    const Normalizer& normalizer, Batch& batch, Worker& worker, Index first,
                    Index end) {
  using Clock = std::chrono::steady_clock;
  Lane& lane = lanes_[static_cast<std::size_t>(index)];
  Environment& environment = *lane.environment;
  double physics = 0;
  const Clock::time_point begin = Clock::now();
  if (first == 0) {
    lane.finished.clear();
    lane.diverged = 0;
    lane.physics_seconds = lane.inference_seconds = 0;
    if (lane.episode < 0) start_episode(index);
  }

  const auto store = [&](Matrix<float>& matrix, Index column) {
    const std::span<const double> observation = environment.observation();
    float* to = matrix.col(column).data();
    for (std::size_t i = 0; i < observation.size(); ++i) to[i] = static_cast<float>(observation[i]);
  };

  for (Index t = first; t < end; ++t) {
    const Index j = index * batch.steps + t;
    store(batch.observations, j);
    normalizer.apply(batch.observations.col(j).data(), batch.inputs.col(j).data());
    network.mlp.forward(theta.data(), batch.inputs.block(0, j, network.mlp.inputs() + 1, 1),
                        worker.tape, 0);
    RandomStream random(seed_, Purpose::kAct, static_cast<std::uint32_t>(index),
                        static_cast<std::uint32_t>(lane.episode),
                        static_cast<std::uint32_t>(environment.elapsed_steps()));
    float* action = batch.actions.col(j).data();
    network.distribution.sample(worker.tape.outputs.back().data(), network.log_std(theta.data()),
                                random, action);
    units_.execute(action, worker.executed.data());

    const Clock::time_point before = Clock::now();
    const StepResult result = environment.step(worker.executed);
    lane.episode_return += result.reward;
    batch.rewards[j] = static_cast<float>(result.reward);
    batch.endings[static_cast<std::size_t>(j)] = result.terminated  ? Ending::kTerminated
                                                 : result.truncated ? Ending::kTruncated
                                                                    : Ending::kNone;
    if (result.diverged) ++lane.diverged;
    const bool done = result.terminated || result.truncated;
    if (batch.has_final_observation(j)) store(batch.final_observations, j);
    if (done) {
      lane.finished.push_back(
          {lane.episode_return, static_cast<double>(environment.elapsed_steps())});
      start_episode(index);
    }
    physics += std::chrono::duration<double>(Clock::now() - before).count();
  }
  lane.physics_seconds += physics;
  lane.inference_seconds += std::chrono::duration<double>(Clock::now() - begin).count() - physics;
}

void Collector::collect(const PolicyNetwork<float>& network, const Vector<float>& theta,
                        const Normalizer& normalizer, Batch& batch, Stopwatch& stopwatch) {
  while (workers_.size() < static_cast<std::size_t>(team_.pool().threads()))
    workers_.push_back({network.mlp.make_tape(1),
                        std::vector<float>(static_cast<std::size_t>(spec().action.dim))});
  take_turns(batch.steps, [&](Index lane, int worker, Index first, Index end) {
    act(lane, network, theta, normalizer, batch, workers_[static_cast<std::size_t>(worker)], first,
        end);
  });
  if (team_.ranks() > 1) exchange_batch(normalizer, batch);
  batch.finished.clear();
  batch.diverged = 0;
  double physics = 0, inference = 0;
  for (const Lane& lane : lanes_) {
    batch.finished.insert(batch.finished.end(), lane.finished.begin(), lane.finished.end());
    batch.diverged += lane.diverged;
    physics += lane.physics_seconds;
    inference += lane.inference_seconds;
  }
  // What other ranks measured is theirs: zero here.
  const auto threads = static_cast<double>(std::min<Index>(own_.size(), team_.pool().threads()));
  stopwatch.move_to(Phase::kPhysics, physics / threads);
  stopwatch.move_to(Phase::kInference, inference / threads);
  stopwatch.move_flops_to(Phase::kInference);
}

void Collector::replay(const Batch& batch) {
  take_turns(batch.steps, [&](Index index, int, Index first, Index end) {
    Lane& lane = lanes_[static_cast<std::size_t>(index)];
    std::vector<float> executed(static_cast<std::size_t>(spec().action.dim));
    if (lane.episode < 0) start_episode(index);
    for (Index t = first; t < end; ++t) {
      units_.execute(batch.actions.col(index * batch.steps + t).data(), executed.data());
      const StepResult result = lane.environment->step(executed);
      lane.episode_return += result.reward;
      if (result.terminated || result.truncated) start_episode(index);
    }
  });
}

void Collector::archive(Archive& a) {
  std::vector<LaneState> states(lanes_.size());
  if (!a.loading()) save_lanes(states);
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    LaneState& state = states[i];
    a.scope(std::to_string(i), [&](Archive& inner) {
      inner.resizable("environment", state.environment);
      inner("episode", state.episode);
      inner("episode_return", state.episode_return);
    });
    Lane& lane = lanes_[i];
    if (!a.loading() || !lane.environment) continue;
    lane.episode = state.episode;
    lane.episode_return = state.episode_return;
    if (lane.episode < 0) continue;
    if (state.environment.empty())  // it cannot save its state: a new episode
      start_episode(static_cast<Index>(i));
    else
      lane.environment->restore(state.environment);
  }
}

}  // namespace agail
