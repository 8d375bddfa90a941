// Collecting batches: lanes step their own environments with the current policy.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "agail/base/archive.h"
#include "agail/base/stopwatch.h"
#include "agail/comm/collectives.h"
#include "agail/comm/team.h"
#include "agail/env/environment.h"
#include "agail/nn/normalizer.h"
#include "agail/rl/action_units.h"

namespace agail {

enum class Ending : std::uint8_t { kNone, kTerminated, kTruncated };

struct FinishedEpisode {
  double episode_return = 0;  // undiscounted, of the environment's own reward
  double length = 0;
};

// lanes x steps samples, one a column; lane l owns columns [l * steps, (l + 1) * steps) in the
// order of time.
struct Batch {
  Batch(int observation_dim, int action_dim, Index lane_count, Index steps_a_lane);

  Index lanes = 0, steps = 0;
  Index size() const { return lanes * steps; }
  bool lane_ends(Index column) const { return (column + 1) % steps == 0; }
  bool has_final_observation(Index column) const {
    return lane_ends(column) || endings[static_cast<std::size_t>(column)] != Ending::kNone;
  }

  Matrix<float> observations;  // observation_dim x n
  Matrix<float>
      inputs;  // the same, normalised, with a row of ones: what policy and value networks see
  Matrix<float> actions;             // action_dim x n, in ActionUnits, as sampled (not clipped)
  Vector<float> rewards;             // n, the environment's
  std::vector<Ending> endings;       // n
  Matrix<float> final_observations;  // the state after a column that truncates or ends its lane;
                                     // others: undefined
  std::vector<FinishedEpisode> finished;
  std::int64_t diverged = 0;  // episodes that ended because the simulation broke down
};

class Collector {
 public:
  // Ranks share the lanes; InputError if there are more ranks than lanes.
  Collector(const std::string& environment, Index lanes, std::uint64_t seed, Team team);

  const EnvironmentSpec& spec() const {
    return lanes_[static_cast<std::size_t>(own_.begin)].environment->spec();
  }

  // Fills the batch, each lane on one thread of one rank. The policy and the normaliser do not
  // change meanwhile.
  void collect(const PolicyNetwork<float>& network, const Vector<float>& theta,
               const Normalizer& normalizer, Batch& batch, Stopwatch& stopwatch);

  // Steps through the actions of a batch again, from the state that this collector is in: the same
  // physics without any learning or network, which is what training is measured against.
  void replay(const Batch& batch);

  // Everything that the next batch depends on, the environments' state included. When saving, all
  // ranks must take part, and all get all lanes.
  void archive(Archive& a);

 private:
  struct Lane {
    std::unique_ptr<Environment> environment;  // null: another rank's lane
    std::int64_t episode = -1;                 // number of the episode under way; -1: none yet
    double episode_return = 0;
    std::vector<FinishedEpisode> finished;  // in the batch under way
    std::int64_t diverged = 0;
    double physics_seconds = 0, inference_seconds = 0;
  };
  struct Worker {
    Tape<float> tape;
    std::vector<float> executed;
  };
  // Calls steps(lane, worker, first, end) until each of this rank's lanes has done its `count`
  // steps: some at a time, so that at the end no thread is left with a whole lane.
  template <class Steps>
  void take_turns(Index count, Steps&& steps);
  void act(Index index, const PolicyNetwork<float>& network, const Vector<float>& theta,
           const Normalizer& normalizer, Batch& batch, Worker& worker, Index first, Index end);
  void start_episode(Index index);

  // From every rank to every rank (rollout_exchange.cc): what the lanes collected, and their
  // states.
  struct LaneState {
    std::vector<double> environment;
    std::int64_t episode = -1;
    double episode_return = 0;
  };
  void pack_batch(const Batch& batch);
  void exchange_batch(const Normalizer& normalizer, Batch& batch);
  void save_lanes(std::vector<LaneState>& states);

  std::uint64_t seed_;
  Team team_;
  Share own_;  // this rank's lanes
  std::vector<Lane> lanes_;
  ActionUnits units_;
  struct Turn {
    Index lane, step;
  };
  std::vector<Turn> turns_;  // a ring: lanes waiting for their turn
  std::vector<Worker> workers_;
  Bytes message_;
  Blocks all_;
};

}  // namespace agail
