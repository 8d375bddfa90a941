// The guide Q(a_E | s, a): what the demonstrator does at s, told the policy's action a; categorical
// for discrete actions, diagonal Gaussian for continuous ones. Trained by maximum likelihood on
// available actions only:
//
//   maximise  E log Q(a_E | s_E, a),   s_E, a_E ~ demonstrations, a ~ policy(. | s_E)          (Sun
//   & Ma, 2019, eq. 8)
//
// guide.target says at which a_E the reward asks it (see the documentation for what each can
// carry):
//   random   an available demonstrated action drawn at random: the paper's text
//   nearest  the available action of the nearest demonstrated state
//   own      the policy's own action, with Q(a | s) a model of the demonstrator alone
#pragma once

#include <memory>

#include "agail/base/archive.h"
#include "agail/imitation/demo_data.h"
#include "agail/nn/adam.h"
#include "agail/nn/normalizer.h"
#include "agail/rl/policy_network.h"

namespace agail {

class NearestState;

struct GuideReport {
  double loss = 0;                     // -E log Q, over the last update's minibatches
  double held_out_log_likelihood = 0;  // E log Q on available actions that it never learned from
  double action_variance_share =
      0;  // share of r_Q's variance that is due to the action at a fixed state
};

// The policy as the guide asks it: its function at present, and the normaliser of its inputs.
struct PolicyView {
  const PolicyNetwork<float>& network;
  const Vector<float>& theta;
  const Normalizer& normalizer;
};

// The network: [s; a] -> 2 x hidden, where the first half sees s only and the second a only ->
// hidden -> outputs; for `own` just s -> hidden -> hidden -> outputs. Parameters: the MLP's, then
// log_std.
template <class S>
class GuideNetwork {
 public:
  GuideNetwork(Index observation_dim, const ActionSpace& action, Index hidden, bool sees_action);

  Index parameters() const { return mlp.parameters() + distribution.log_stds(); }
  const S* log_std(const S* theta) const { return theta + mlp.parameters(); }
  void initialise(S* theta, RandomStream& random) const;

  // Mean loss -log Q over n columns and its gradient. x: inputs with ones; targets, available:
  // action_dim x n.
  double loss(ThreadPool& pool, ChunkSums<S>& sums, std::vector<Scratch<S>>& scratch,
              const Vector<S>& theta, const Matrix<S>& x, const Matrix<S>& targets,
              const Matrix<S>& available, Index n, Vector<S>& gradient) const;

  ActionDistribution<S> distribution;
  Mlp<S> mlp;

 private:
  void separate(
      S* first_layer) const;  // zero where s meets the units of a, and the other way round
  Index observation_dim_;
  bool sees_action_;
};

extern template class GuideNetwork<float>;
extern template class GuideNetwork<double>;

class Guide {
 public:
  // Needs at least one available action.
  Guide(const DemoData& demos, const ActionSpace& action, const GuideSettings& settings,
        Index minibatch, double clip, Team team, std::uint64_t seed);
  ~Guide();

  // `minibatches` steps of Adam. `update` numbers the call.
  GuideReport learn(const PolicyView& policy, Index minibatches, std::uint32_t update);

  // r_Q of n samples. states: observation_dim x n; actions: as executed.
  void rewards(const Matrix<float>& states, const Matrix<float>& actions, Index n,
               std::uint32_t update, Vector<float>& rewards);

  // Fills the two diagnostics of the report; does not disturb learning.
  void diagnose(const PolicyView& policy, const Matrix<float>& states, Index n,
                std::uint32_t update, GuideReport& report);

  void archive(Archive& a);

 private:
  bool sees_action() const { return settings_.target != "own"; }
  // What the policy does at states: put into slots, run through its network together, then sampled
  // one by one.
  void show_policy(const PolicyView& policy, const float* state, Index slot);
  void run_policy(const PolicyView& policy, Index slots);
  void act(const PolicyView& policy, Index slot, RandomStream& random, float* executed);
  // Q's outputs for the first columns of diagnostic_x_, into tape_.
  void run_guide(Index columns);
  double held_out_log_likelihood(const PolicyView& policy, RandomStream& random);
  double action_variance_share(const PolicyView& policy, const Matrix<float>& states, Index n,
                               RandomStream& random);
  void build_input(const float* state, const float* action, float* x) const;
  // The demonstrated action that the reward asks about: nearest, or random.
  Index target_column(const float* state, RandomStream& random) const;
  // Reward at network output `output`, for the demonstrated (or own) action and its available
  // dimensions.
  float reward(const float* output, const float* target, const float* available) const;

  const DemoData& demos_;
  ActionSpace action_;
  GuideSettings settings_;
  Team team_;
  std::uint64_t seed_;
  Index minibatch_;
  GuideNetwork<float> network_;
  Normalizer normalizer_;  // of states, from the demonstrations; fixed
  Vector<float> theta_;
  Adam<float> adam_;
  std::vector<Index> training_, held_out_;  // columns of demos_ with an available action
  std::vector<float> known_dimensions_;     // 1 where any demonstration has the dimension
  std::unique_ptr<NearestState> nearest_;   // guide.target = nearest
  ChunkSums<float> sums_;
  std::vector<Scratch<float>> scratch_;
  std::vector<Matrix<float>> chunk_x_;  // of rewards(), one a worker
  Tape<float> tape_, policy_tape_;
  Matrix<float> policy_input_, x_, targets_, available_, diagnostic_x_;
  Vector<float> gradient_;
  std::vector<float> sampled_, executed_;
  std::vector<Index> drawn_;
  Matrix<float> fresh_actions_;
};

}  // namespace agail
