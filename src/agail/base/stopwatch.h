// Where a training run spends its time and does its arithmetic: one phase at a time, switched by
// the code that starts it.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

#include "agail/base/flops.h"

namespace agail {

enum class Phase : std::size_t {
  kPhysics,
  kInference,
  kPolicyGradient,
  kConjugateGradient,
  kLineSearch,
  kValue,
  kDiscriminator,
  kGuide,
  kRest,
  kCount
};

inline constexpr std::array<const char*, static_cast<std::size_t>(Phase::kCount)> kPhaseNames = {
    "physics",     "inference", "policy_gradient", "conjugate_gradient",
    "line_search", "value",     "discriminator",   "guide",
    "rest"};

class Stopwatch {
 public:
  // Starts an update, as its phase kRest; what happened since the last one ended is not counted.
  void begin_update() {
    since_ = Clock::now();
    flops_before_ = counted_flops().load(std::memory_order_relaxed);
    phase_ = Phase::kRest;
  }
  void start(Phase phase) {
    const Clock::time_point now = Clock::now();
    seconds_[static_cast<std::size_t>(phase_)] +=
        std::chrono::duration<double>(now - since_).count();
    since_ = now;
    const std::int64_t flops = counted_flops().load(std::memory_order_relaxed);
    flops_[static_cast<std::size_t>(phase_)] += flops - flops_before_;
    flops_before_ = flops;
    phase_ = phase;
  }
  // Time measured elsewhere (by several threads, divided by their number) that the current phase
  // must not count.
  void move_to(Phase phase, double seconds) {
    seconds_[static_cast<std::size_t>(phase)] += seconds;
    seconds_[static_cast<std::size_t>(phase_)] -= seconds;
  }
  // Arithmetic of the current phase so far that is another's.
  void move_flops_to(Phase phase) {
    const std::int64_t flops = counted_flops().load(std::memory_order_relaxed);
    flops_[static_cast<std::size_t>(phase)] += flops - flops_before_;
    flops_before_ = flops;
  }
  std::int64_t flops(Phase phase) const { return flops_[static_cast<std::size_t>(phase)]; }
  double seconds(Phase phase) const { return seconds_[static_cast<std::size_t>(phase)]; }

 private:
  using Clock = std::chrono::steady_clock;
  std::array<double, static_cast<std::size_t>(Phase::kCount)> seconds_{};
  std::array<std::int64_t, static_cast<std::size_t>(Phase::kCount)> flops_{};
  std::int64_t flops_before_ = counted_flops().load(std::memory_order_relaxed);
  Clock::time_point since_ = Clock::now();
  Phase phase_ = Phase::kRest;
};

}  // namespace agail
