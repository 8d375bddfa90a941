// Sums in the order in which NumPy adds, so that rewards have the bits of Gymnasium's.
#pragma once

#include <array>
#include <cstddef>

namespace agail {

// np.sum of the n values value(0), ..., value(n-1), which are contiguous for NumPy: in order below
// 8 values, with eight accumulators up to 128, in halves above. T is the type in which NumPy adds.
template <class T, class F>
T numpy_sum(std::size_t begin, std::size_t n, const F& value) {
  if (n < 8) {
    T sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += value(begin + i);
    return sum;
  }
  if (n > 128) {
    const std::size_t half = n / 2 - n / 2 % 8;
    return numpy_sum<T>(begin, half, value) + numpy_sum<T>(begin + half, n - half, value);
  }
  std::array<T, 8> part;
  for (std::size_t k = 0; k < 8; ++k) part[k] = value(begin + k);
  std::size_t i = 8;
  for (; i + 8 <= n; i += 8)
    for (std::size_t k = 0; k < 8; ++k) part[k] += value(begin + i + k);
  T sum = ((part[0] + part[1]) + (part[2] + part[3])) + ((part[4] + part[5]) + (part[6] + part[7]));
  for (; i < n; ++i) sum += value(begin + i);
  return sum;
}

}  // namespace agail
