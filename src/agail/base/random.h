// Counter-based random numbers (Philox4x32-10, Salmon et al., SC 2011; Random123).
//
// A stream is named, not advanced from a global state: key = seed, counter = (purpose, lane,
// episode, step). Whoever needs numbers builds the stream for its own name, so the numbers do not
// depend on the order in which threads or ranks ask, and a resumed run needs no generator state.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace agail {

// What the numbers are for. Values are part of the reproducibility promise: never renumber.
enum class Purpose : std::uint32_t {
  kInitialise = 1,     // network weights; lane = which network
  kReset = 2,          // environment resets
  kAct = 3,            // actions while training
  kEvaluate = 4,       // resets and actions of an evaluation
  kRecord = 5,         // resets and actions of recorded demonstrations
  kMask = 6,           // which actions are removed
  kShuffle = 7,        // minibatch order; lane = which learner
  kDiscriminator = 8,  // states drawn for the discriminator
  kGuide = 9,          // states and actions drawn for the guide
  kGuideReward = 10,   // demonstrated actions drawn for the guide's reward
  kDiagnostics = 11,   // measurements that must not disturb learning
  kClone = 12,         // behaviour cloning
  kInverseDynamics = 13,
  kBootstrap = 14,  // resampling of confidence intervals
  kHoldout = 15,    // which demonstrations are kept for validation
  kPredict = 16,    // stochastic actions of a policy that is used from Python
};

class RandomStream {
 public:
  RandomStream(std::uint64_t seed, Purpose purpose, std::uint32_t lane = 0,
               std::uint32_t episode = 0, std::uint32_t step = 0);

  std::uint32_t bits();  // 32 random bits
  double uniform();      // [0, 1), 53 bits
  double uniform(double low, double high);
  double normal();                       // standard normal, Box-Muller
  std::uint32_t below(std::uint32_t n);  // {0, ..., n-1}, unbiased (Lemire); n > 0

 private:
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> counter_;  // word 0: purpose in the top 8 bits, block number below
  std::array<std::uint32_t, 4> block_{};
  unsigned used_ = 4;
  double spare_normal_ = 0;
  bool has_spare_ = false;
};

// Fisher-Yates. Any random-access container.
template <class Container>
void shuffle(Container& items, RandomStream& random) {
  for (std::size_t i = items.size(); i > 1; --i)
    std::swap(items[i - 1], items[random.below(static_cast<std::uint32_t>(i))]);
}

}  // namespace agail
