// Matrix types of the networks. A batch is a matrix with one sample a column.
#pragma once

#include <Eigen/Core>
#include <span>

namespace agail {

using Index = Eigen::Index;

template <class S>
using Matrix = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic>;
template <class S>
using Vector = Eigen::Matrix<S, Eigen::Dynamic, 1>;
template <class S>
using RowVector = Eigen::Matrix<S, 1, Eigen::Dynamic>;

// Views of some columns of a matrix; never a copy.
template <class S>
using View = Eigen::Ref<Matrix<S>, 0, Eigen::OuterStride<>>;
template <class S>
using ConstView = Eigen::Ref<const Matrix<S>, 0, Eigen::OuterStride<>>;

// All numbers of a matrix, column by column.
template <class S, int columns>
std::span<S> all_of(Eigen::Matrix<S, Eigen::Dynamic, columns>& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.size())};
}

// Learning works on chunks of this many samples; their sums are added along a fixed tree
// (chunks.h).
inline constexpr Index kChunk = 64;

// Rows rounded up so that every column of a matrix starts on a 64-byte boundary: whole packets, and
// the same bits wherever the matrix lies.
inline constexpr Index padded(Index rows) { return (rows + 15) / 16 * 16; }

}  // namespace agail
