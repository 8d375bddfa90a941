// How much arithmetic was done, for benchmarks.
#pragma once

#include <atomic>
#include <cstdint>

namespace agail {

// Floating-point operations of matrix products so far, of all threads of this process. A product
// takes a microsecond, the addition some nanoseconds.
inline std::atomic<std::int64_t>& counted_flops() {
  static std::atomic<std::int64_t> flops{0};
  return flops;
}

inline void count_flops(std::int64_t flops) {
  counted_flops().fetch_add(flops, std::memory_order_relaxed);
}

}  // namespace agail
