#include "agail/imitation/nearest_state.h"

#include <gtest/gtest.h>

#include "imitation/support.h"

namespace agail {
namespace {

TEST(NearestState, EqualsTheScanOfAllStates) {
  ThreadPool pool(1);
  for (const Index dim : {1, 4, 11, 40}) {
    constexpr Index n = 500;
    Matrix<double> states = reference::normal_matrix(dim, n + 1, 1);
    for (Index i = 0; i < dim; ++i) states.row(i) *= static_cast<double>(1 + 5 * i);
    const DemoData demos(
        demonstrations_from(states, Matrix<double>::Zero(1, n), continuous_actions(1)));
    Normalizer normalizer(dim, true, 5);
    normalizer.update(pool, demos.states);
    std::vector<Index> columns;
    for (Index j = 0; j < n; ++j)
      if (j % 3 != 1) columns.push_back(j);
    const NearestState nearest(demos, columns, normalizer);

    Matrix<float> queries = (1.3 * reference::normal_matrix(dim, 200, 2)).cast<float>();
    for (Index i = 0; i < dim; ++i) queries.row(i) *= static_cast<float>(1 + 5 * i);
    for (Index j = 0; j < 20; ++j) queries.col(j) = demos.states.col(3 * j);
    const auto distance = [&](Index query, Index column) {
      Vector<float> a(dim + 1), b(dim + 1);
      normalizer.apply(queries.col(query).data(), a.data());
      normalizer.apply(demos.states.col(column).data(), b.data());
      return (a - b).cast<double>().squaredNorm();
    };
    for (Index q = 0; q < queries.cols(); ++q) {
      const Index found = nearest.find(queries.col(q).data());
      ASSERT_NE(found % 3, 1);
      double best = std::numeric_limits<double>::infinity();
      for (const Index column : columns) best = std::min(best, distance(q, column));
      EXPECT_LE(distance(q, found), best * (1 + 1e-5)) << "dim " << dim << " query " << q;
      if (q < 20) {
        EXPECT_EQ(found, 3 * q);
      }
    }
  }
}

}  // namespace
}  // namespace agail
