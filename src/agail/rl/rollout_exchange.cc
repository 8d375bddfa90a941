// What ranks tell each other of their lanes.
#include "agail/comm/pack.h"
#include "agail/rl/rollout.h"

namespace agail {

// Columns of the rank's lanes; of final observations only those that mean something. Inputs are
// made from the observations again, which costs less than sending them.
void Collector::pack_batch(const Batch& batch) {
  Packer pack(message_);
  const Index first = own_.begin * batch.steps, last = own_.end * batch.steps;
  const auto count = static_cast<std::size_t>(last - first);
  const auto rows = static_cast<std::size_t>(batch.observations.rows());
  pack.array(batch.observations.col(first).data(), rows * count);
  pack.array(batch.actions.col(first).data(),
             static_cast<std::size_t>(batch.actions.rows()) * count);
  pack.array(batch.rewards.data() + first, count);
  pack.array(batch.endings.data() + first, count);
  for (Index j = first; j < last; ++j)
    if (batch.has_final_observation(j)) pack.array(batch.final_observations.col(j).data(), rows);
  for (Index l = own_.begin; l < own_.end; ++l) {
    const Lane& lane = lanes_[static_cast<std::size_t>(l)];
    pack.number(lane.diverged);
    pack.number(lane.finished.size());
    pack.array(lane.finished.data(), lane.finished.size());
  }
}

void Collector::exchange_batch(const Normalizer& normalizer, Batch& batch) {
  pack_batch(batch);
  allgather(team_.communicator(), message_, all_);
  const auto rows = static_cast<std::size_t>(batch.observations.rows());
  for (int r = 0; r < team_.ranks(); ++r) {
    if (r == team_.rank()) continue;
    Unpacker unpack(all_[r]);
    const Share share = share_of(static_cast<Index>(lanes_.size()), team_.ranks(), r);
    const Index first = share.begin * batch.steps, last = share.end * batch.steps;
    const auto count = static_cast<std::size_t>(last - first);
    unpack.array(batch.observations.col(first).data(), rows * count);
    unpack.array(batch.actions.col(first).data(),
                 static_cast<std::size_t>(batch.actions.rows()) * count);
    unpack.array(batch.rewards.data() + first, count);
    unpack.array(batch.endings.data() + first, count);
    for (Index j = first; j < last; ++j) {
      if (batch.has_final_observation(j))
        unpack.array(batch.final_observations.col(j).data(), rows);
      normalizer.apply(batch.observations.col(j).data(), batch.inputs.col(j).data());
    }
    for (Index l = share.begin; l < share.end; ++l) {
      Lane& lane = lanes_[static_cast<std::size_t>(l)];
      lane.diverged = unpack.number<std::int64_t>();
      lane.finished.resize(unpack.number<std::size_t>());
      unpack.array(lane.finished.data(), lane.finished.size());
    }
  }
}

void Collector::save_lanes(std::vector<LaneState>& states) {
  Packer pack(message_);
  for (Index l = own_.begin; l < own_.end; ++l) {
    const Lane& lane = lanes_[static_cast<std::size_t>(l)];
    LaneState& state = states[static_cast<std::size_t>(l)];
    state.episode = lane.episode;
    state.episode_return = lane.episode_return;
    if (lane.episode >= 0) state.environment = lane.environment->save();
    pack.number(state.episode);
    pack.number(state.episode_return);
    pack.number(state.environment.size());
    pack.array(state.environment.data(), state.environment.size());
  }
  if (team_.ranks() == 1) return;
  allgather(team_.communicator(), message_, all_);
  Unpacker unpack(all_.bytes);
  for (LaneState& state : states) {
    state.episode = unpack.number<std::int64_t>();
    state.episode_return = unpack.number<double>();
    state.environment.resize(unpack.number<std::size_t>());
    unpack.array(state.environment.data(), state.environment.size());
  }
}

}  // namespace agail
