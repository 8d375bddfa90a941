// Products of the small matrices that networks are made of (some hundred rows, kChunk columns).
// Eigen's own spend a third of their time on copying both operands into another order; these read
// them where they lie. Same bits wherever the operands lie in memory.
#pragma once

#include "agail/nn/matrix.h"

namespace agail {

// What acting, one column at a time, computes with at most, though the processor has wider packets:
// those would slow the physics down (product.cc).
inline constexpr int kNarrowBytes = 32;

// c = a b, or c += a b. a: m x k, b: k x n, c: m x n; c overlaps neither.
template <class S>
void multiply(const ConstView<S>& a, const ConstView<S>& b, View<S> c, bool add = false);

// c = a^T b. a: k x m, b: k x n.
template <class S>
void multiply_transposed(const ConstView<S>& a, const ConstView<S>& b, View<S> c);

// c = a b^T, or c += a b^T. a: m x k, b: n x k.
template <class S>
void multiply_by_transposed(const ConstView<S>& a, const ConstView<S>& b, View<S> c,
                            bool add = false);

}  // namespace agail
