#include "peak.h"

#include <Eigen/Core>
#include <algorithm>
#include <chrono>

#pragma GCC diagnostic ignored "-Wignored-attributes"  // vector types as template arguments

namespace agail {

double peak_flops_per_second() {
  using Packet = Eigen::internal::packet_traits<float>::type;
  using Clock = std::chrono::steady_clock;
  constexpr int kWidth = Eigen::internal::packet_traits<float>::size;
  constexpr int kSums = 12;  // more than latency times units, fewer than registers
  constexpr int kSteps = 200'000;
  constexpr int kRuns = 20;
  double best = 0;
  volatile float given = 0.999F;  // not known to the compiler
  const float factor = given;
  volatile float sink = 0;
  for (int run = 0; run < kRuns; ++run) {
    const auto f = Eigen::internal::pset1<Packet>(factor);
    Packet sum[kSums];
    // Each from a load of its own: equal sums would be computed once.
    for (Packet& s : sum) s = Eigen::internal::pset1<Packet>(static_cast<float>(given));
    const Clock::time_point start = Clock::now();
    for (int i = 0; i < kSteps; ++i) {
      for (Packet& s : sum) s = Eigen::internal::pmadd(s, f, f);
    }
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    for (const Packet& s : sum) sink = sink + Eigen::internal::pfirst(s);
    best = std::max(best, 2.0 * kWidth * kSums * kSteps / seconds);
  }
  return best;
}

}  // namespace agail
