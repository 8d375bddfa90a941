#include "agail/nn/product.h"

#include <algorithm>
#include <type_traits>

#include "agail/base/flops.h"

// Eigen's packets are vector types; their alignment, which templates drop, is not relied on.
#pragma GCC diagnostic ignored "-Wignored-attributes"

// All three products are sums of outer products: c = sum_p a_p b_p^T. A panel of rows of c is cut
// into tiles of kPackets packets x kColumns columns, as many as the registers hold; a tile runs
// through all p with one load for each packet of a_p and one broadcast for each element of b_p.
namespace agail {

namespace {

using Eigen::internal::padd;
using Eigen::internal::ploadu;
using Eigen::internal::pmadd;
using Eigen::internal::predux;
using Eigen::internal::pset1;
using Eigen::internal::pstoreu;

template <class S>
using Packet = typename Eigen::internal::packet_traits<S>::type;
template <class S>
inline constexpr int kWidth = Eigen::internal::packet_traits<S>::size;

// For products with a single column: an action, between two steps of the physics. Multiplying
// 512-bit packets makes many processors lower the core's clock for about a millisecond, and slows
// the physics. Every sum is added in the same order with either packet.
template <class S>
using Narrow =
    std::conditional_t<(sizeof(Packet<S>) > kNarrowBytes),
                       typename Eigen::internal::unpacket_traits<Packet<S>>::half, Packet<S>>;

// Of a packet V: its numbers' type, and how many there are.
template <class V>
using Scalar = typename Eigen::internal::unpacket_traits<V>::type;
template <class V>
inline constexpr int kLanes = Eigen::internal::unpacket_traits<V>::size;

constexpr bool kManyRegisters = EIGEN_ARCH_DEFAULT_NUMBER_OF_REGISTERS >= 32;
constexpr int kPackets = kManyRegisters ? 4 : 2;
template <class V>  // of a tile with a single column
constexpr int kPacketsAlone = kManyRegisters && sizeof(V) <= kNarrowBytes ? 16 : 8;
constexpr Index kDepth = 256;  // steps of p at a time, so that a packed panel stays in the cache

// One factor as a tile reads it: element (i, p) of a at a[i + p * step], or element (p, j) of b at
// b[p * step + j * column].
template <class S>
struct Left {
  const S* data;
  Index step;
};
template <class S>
struct Right {
  const S* data;
  Index step, column;
};
template <class S>
struct Result {
  S* data;
  Index column;
  bool add;
};

// Columns of a tile of `packets`: their sums, one packet of each column and one broadcast fit the
// registers.
constexpr int columns_for(int packets) {
  return kManyRegisters ? (packets > 3 ? 6 : 8) : (packets > 1 ? 4 : 8);
}

// Rows of a tile. Rows that fill no packet of their own are covered by a last packet that overlaps
// the one before it, so nothing is read past the end; only its lanes from `from` on are new.
struct Rows {
  Index last;  // first row of the last packet
  Index from;
};

// Loops over indices known at compile time, which must be unrolled to keep the sums in registers.
#define AGAIL_UNROLL _Pragma("GCC unroll 16")

template <class V, int P, int N, class S = Scalar<V>>
[[gnu::always_inline]] inline void tile(Left<S> a, Right<S> b, Index depth, Result<S> c,
                                        Rows rows) {
  V sum[P][N];
  AGAIL_UNROLL
  for (int j = 0; j < N; ++j) {
    AGAIL_UNROLL
    for (int i = 0; i < P; ++i) sum[i][j] = pset1<V>(S(0));
  }
  for (Index p = 0; p < depth; ++p, a.data += a.step, b.data += b.step) {
    if constexpr (N == 1)  // observations have channels at rest, whose weights need not be fetched
      if (b.data[0] == S(0)) continue;
    V left[P];
    AGAIL_UNROLL
    for (int i = 0; i + 1 < P; ++i) left[i] = ploadu<V>(a.data + i * kLanes<V>);
    left[P - 1] = ploadu<V>(a.data + rows.last);
    AGAIL_UNROLL
    for (int j = 0; j < N; ++j) {
      const auto right = pset1<V>(b.data[j * b.column]);
      AGAIL_UNROLL
      for (int i = 0; i < P; ++i) sum[i][j] = pmadd(left[i], right, sum[i][j]);
    }
  }
  AGAIL_UNROLL
  for (int j = 0; j < N; ++j) {
    S* column = c.data + j * c.column;
    AGAIL_UNROLL
    for (int i = 0; i < P; ++i) {
      S* to = column + (i + 1 < P ? i * kLanes<V> : rows.last);
      if (!c.add) {  // lanes that overlap are the same sums once more
        pstoreu(to, sum[i][j]);
      } else if (i + 1 < P || rows.from == 0) {
        pstoreu(to, padd(ploadu<V>(to), sum[i][j]));
      } else {
        S lanes[kLanes<V>];
        pstoreu(lanes, sum[i][j]);
        for (Index r = rows.from; r < kLanes<V>; ++r) to[r] += lanes[r];
      }
    }
  }
}

template <class V, int P, class S = Scalar<V>>
void panel_of_packets(Left<S> a, Right<S> b, Index depth, Index columns, Result<S> c, Rows rows) {
  Index j = 0;
  const auto right = [&] { return Right<S>{b.data + j * b.column, b.step, b.column}; };
  const auto result = [&] { return Result<S>{c.data + j * c.column, c.column, c.add}; };
  if constexpr (P <= kPackets) {
    constexpr int kColumns = columns_for(P);
    for (; j + kColumns <= columns; j += kColumns)
      tile<V, P, kColumns>(a, right(), depth, result(), rows);
    for (; j + 4 <= columns; j += 4) tile<V, P, 4>(a, right(), depth, result(), rows);
    for (; j + 2 <= columns; j += 2) tile<V, P, 2>(a, right(), depth, result(), rows);
  }
  for (; j < columns; ++j) tile<V, P, 1>(a, right(), depth, result(), rows);
}

// The panel with as many packets, found among those known at compile time.
template <class V, int P = kPacketsAlone<V>, class S = Scalar<V>>
void panel(Index packets, Left<S> a, Right<S> b, Index depth, Index columns, Result<S> c,
           Rows rows) {
  if (packets == P)
    panel_of_packets<V, P>(a, b, depth, columns, c, rows);
  else if constexpr (P > 1)
    panel<V, P - 1>(packets, a, b, depth, columns, c, rows);
}

// to[i + p * step] = from[p + i * column] for i < rows, zero for the other i < step.
template <class S>
void pack_transposed(const S* from, Index column, Index rows, Index depth, S* to, Index step) {
  constexpr Index kBlock = kWidth<S>;
  for (Index i = 0; i < step; i += kBlock) {
    Index p = 0;
    if (i + kBlock <= rows)
      for (; p + kBlock <= depth; p += kBlock) {
        Eigen::internal::PacketBlock<Packet<S>, kWidth<S>> block;
        for (Index r = 0; r < kBlock; ++r)
          block.packet[r] = ploadu<Packet<S>>(from + p + (i + r) * column);
        Eigen::internal::ptranspose(block);
        for (Index r = 0; r < kBlock; ++r) pstoreu(to + i + (p + r) * step, block.packet[r]);
      }
    for (; p < depth; ++p)
      for (Index r = i; r < i + kBlock; ++r)
        to[r + p * step] = r < rows ? from[p + r * column] : S(0);
  }
}

enum class Lies { kPlain, kTransposed };

// For m >= kLanes<V>.
template <class V, Lies lies, class S = Scalar<V>>
void multiply_any(const S* a, Index a_column, Index m, Index k, Right<S> b, Index n, Result<S> c) {
  constexpr Index kW = kLanes<V>;
  alignas(64) S packed[kDepth * kPackets * kW];
  const Index tallest = (lies == Lies::kPlain && n == 1 ? kPacketsAlone<V> : kPackets);
  for (Index p = 0; p < k; p += kDepth) {
    const Index depth = std::min(kDepth, k - p);
    const Right<S> right{b.data + p * b.step, b.step, b.column};
    for (Index done = 0; done < m;) {
      const Index first = std::min(done, m - kW);
      // Panels of about equal height: a single packet alone would wait for its own sums.
      const Index left_over = (m - first + kW - 1) / kW;
      const Index panels = (left_over + tallest - 1) / tallest;
      const Index count = std::min((left_over + panels - 1) / panels * kW, m - first);
      const Index packets = (count + kW - 1) / kW;
      const Index last = count - kW;
      const Rows rows{last, std::max(done - first, (packets - 1) * kW) - last};
      Left<S> left{a + first + p * a_column, a_column};
      if (lies == Lies::kTransposed) {
        left = {packed, packets * kW};
        pack_transposed(a + p + first * a_column, a_column, count, depth, packed, left.step);
      }
      panel<V>(packets, left, right, depth, n, {c.data + first, c.column, c.add || p > 0}, rows);
      done = first + count;
    }
  }
}

// Few rows do not fill a packet: the products of a network's last layer, of which there are several
// for each of the others.

// kWidth partial sums of a dot product take this many packets V.
template <class V, class S = Scalar<V>>
inline constexpr int kParts = kWidth<S> / kLanes<V>;

// Their sum: halves are added until one number is left, in one order whatever V is.
template <class V, class S = Scalar<V>>
S total(const V (&parts)[kParts<V>]) {
  if constexpr (kParts<V> == 2)
    return predux(padd(parts[0], parts[1]));
  else if constexpr (sizeof(V) > kNarrowBytes)
    return predux(Eigen::internal::predux_half_dowto4(parts[0]));
  else
    return predux(parts[0]);
}

// Dot products of R rows, which lie `row_step` apart, with N columns of b, groups of kWidth numbers
// 0 to `groups`; `start(q)` is where group q begins in a column.
template <class V, int R, int N, class Start, class S = Scalar<V>>
[[gnu::always_inline]] inline void dots(const S* rows, Index row_step, Right<S> b, Index groups,
                                        const Start& start, Result<S> c) {
  V sum[R][N][kParts<V>];
  AGAIL_UNROLL
  for (int i = 0; i < R; ++i) {
    AGAIL_UNROLL
    for (int j = 0; j < N; ++j) {
      AGAIL_UNROLL
      for (V& part : sum[i][j]) part = pset1<V>(S(0));
    }
  }
  for (Index q = 0; q < groups; ++q) {
    AGAIL_UNROLL
    for (int part = 0; part < kParts<V>; ++part) {
      const S* from = rows + q * kWidth<S> + part * kLanes<V>;
      V left[R];
      AGAIL_UNROLL
      for (int i = 0; i < R; ++i) left[i] = ploadu<V>(from + i * row_step);
      AGAIL_UNROLL
      for (int j = 0; j < N; ++j) {
        const auto right = ploadu<V>(b.data + start(q) + part * kLanes<V> + j * b.column);
        AGAIL_UNROLL
        for (int i = 0; i < R; ++i) sum[i][j][part] = pmadd(left[i], right, sum[i][j][part]);
      }
    }
  }
  AGAIL_UNROLL
  for (int j = 0; j < N; ++j) {
    AGAIL_UNROLL
    for (int i = 0; i < R; ++i) {
      S& to = c.data[i + j * c.column];
      to = c.add ? to + total(sum[i][j]) : total(sum[i][j]);
    }
  }
}

// c = a b for m < kWidth <= k: dot products of rows of a, copied to lie side by side, with columns
// of b. The last group overlaps the one before it; there a's copy holds zeros.
template <class V, class S = Scalar<V>>
void multiply_few_rows(const ConstView<S>& a, const ConstView<S>& b, View<S> c, bool add) {
  constexpr Index kW = kWidth<S>;
  constexpr Index kDots = 8 * kW;  // elements of a row at a time
  constexpr int kRowsOfTile = 3, kColumnsOfTile = 4;
  alignas(64) S rows[kW * kDots];
  const Index m = a.rows(), k = a.cols(), n = b.cols();
  for (Index p = 0; p < k; p += kDots) {
    const Index depth = std::min(kDots, k - p);
    const Index groups = (depth + kW - 1) / kW;
    const Index overlap = groups * kW - depth;
    const auto start = [&](Index q) { return p + q * kW - (q + 1 < groups ? 0 : overlap); };
    for (Index i = 0; i < m; ++i) {
      const S* from = a.data() + i + p * a.outerStride();
      S* to = rows + i * kDots;
      const Index whole = (groups - 1) * kW;
      for (Index t = 0; t < whole; ++t) to[t] = from[t * a.outerStride()];
      std::fill_n(to + whole, overlap, S(0));
      for (Index t = whole; t < depth; ++t) to[t + overlap] = from[t * a.outerStride()];
    }
    const auto columns = [&]<int N>(Index j, std::integral_constant<int, N>) {
      const Right<S> right{b.data() + j * b.outerStride(), 1, b.outerStride()};
      for (Index i = 0; i < m;) {
        const S* from = rows + i * kDots;
        const Result<S> to{c.data() + i + j * c.outerStride(), c.outerStride(), add || p > 0};
        const auto tile_of = [&]<int R>(std::integral_constant<int, R>) {
          dots<V, R, N>(from, kDots, right, groups, start, to);
          return Index{R};
        };
        if (m - i >= kRowsOfTile)
          i += tile_of(std::integral_constant<int, kRowsOfTile>());
        else if (m - i == 2)
          i += tile_of(std::integral_constant<int, 2>());
        else
          i += tile_of(std::integral_constant<int, 1>());
      }
    };
    Index j = 0;
    for (; j + kColumnsOfTile <= n; j += kColumnsOfTile)
      columns(j, std::integral_constant<int, kColumnsOfTile>());
    for (; j < n; ++j) columns(j, std::integral_constant<int, 1>());
  }
}

// c = a b^T for m < kWidth <= n, as the transpose of b a^T.
template <class S>
void multiply_few_rows_by_transposed(const ConstView<S>& a, const ConstView<S>& b, View<S> c,
                                     bool add) {
  constexpr Index kRows = 128;
  S transposed[kRows * kWidth<S>];
  const Index m = a.rows(), k = a.cols(), n = b.rows();
  for (Index done = 0; done < n; done += kRows) {
    const Index first = std::max<Index>(0, std::min(done, n - kRows));
    const Index rows = std::min(kRows, n - first);
    multiply_any<Packet<S>, Lies::kPlain>(b.data() + first, b.outerStride(), rows, k,
                                          {a.data(), a.outerStride(), 1}, m,
                                          {transposed, rows, false});
    for (Index r = done - first; r < rows; ++r)
      for (Index i = 0; i < m; ++i) {
        S& to = c(i, first + r);
        const S value = transposed[r + i * rows];
        to = add ? to + value : value;
      }
  }
}

#undef AGAIL_UNROLL

}  // namespace

// What fits none of the above is tiny: Eigen's.

template <class S>
void multiply(const ConstView<S>& a, const ConstView<S>& b, View<S> c, bool add) {
  eigen_assert(a.cols() == b.rows() && c.rows() == a.rows() && c.cols() == b.cols());
  count_flops(2 * a.size() * c.cols());
  const auto with_packets = [&]<class V>(std::type_identity<V>) {
    if (a.rows() >= kWidth<S>)
      multiply_any<V, Lies::kPlain>(a.data(), a.outerStride(), a.rows(), a.cols(),
                                    {b.data(), 1, b.outerStride()}, b.cols(),
                                    {c.data(), c.outerStride(), add});
    else
      multiply_few_rows<V>(a, b, c, add);
  };
  if (a.cols() >= kWidth<S> || (a.rows() >= kWidth<S> && a.cols() > 0)) {
    if (c.cols() == 1)
      with_packets(std::type_identity<Narrow<S>>());
    else
      with_packets(std::type_identity<Packet<S>>());
  } else if (add)
    c.noalias() += a * b;
  else
    c.noalias() = a * b;
}

template <class S>
void multiply_transposed(const ConstView<S>& a, const ConstView<S>& b, View<S> c) {
  eigen_assert(a.rows() == b.rows() && c.rows() == a.cols() && c.cols() == b.cols());
  count_flops(2 * a.size() * c.cols());
  if (a.cols() >= kWidth<S> && a.rows() > 0)
    multiply_any<Packet<S>, Lies::kTransposed>(a.data(), a.outerStride(), a.cols(), a.rows(),
                                               {b.data(), 1, b.outerStride()}, b.cols(),
                                               {c.data(), c.outerStride(), false});
  else
    c.noalias() = a.transpose() * b;
}

template <class S>
void multiply_by_transposed(const ConstView<S>& a, const ConstView<S>& b, View<S> c, bool add) {
  eigen_assert(a.cols() == b.cols() && c.rows() == a.rows() && c.cols() == b.rows());
  count_flops(2 * a.size() * c.cols());
  if (a.rows() >= kWidth<S> && a.cols() > 0)
    multiply_any<Packet<S>, Lies::kPlain>(a.data(), a.outerStride(), a.rows(), a.cols(),
                                          {b.data(), b.outerStride(), 1}, b.rows(),
                                          {c.data(), c.outerStride(), add});
  else if (b.rows() >= kWidth<S> && a.cols() > 0)
    multiply_few_rows_by_transposed<S>(a, b, c, add);
  else if (add)
    c.noalias() += a * b.transpose();
  else
    c.noalias() = a * b.transpose();
}

#define AGAIL_INSTANTIATE(S)                                                               \
  template void multiply<S>(const ConstView<S>&, const ConstView<S>&, View<S>, bool);      \
  template void multiply_transposed<S>(const ConstView<S>&, const ConstView<S>&, View<S>); \
  template void multiply_by_transposed<S>(const ConstView<S>&, const ConstView<S>&, View<S>, bool);
AGAIL_INSTANTIATE(float)
AGAIL_INSTANTIATE(double)
#undef AGAIL_INSTANTIATE

}  // namespace agail
