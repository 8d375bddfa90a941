#include "agail/imitation/nearest_state.h"

#include <nanoflann.hpp>

namespace agail {

struct NearestState::Tree {
  // Points as nanoflann asks for them: one a column, normalised.
  struct Points {
    Matrix<float> x;
    std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(x.cols()); }
    float kdtree_get_pt(std::size_t column, std::size_t row) const {
      return x(static_cast<Index>(row), static_cast<Index>(column));
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  using Index_ = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Adaptor<float, Points>, Points>;

  explicit Tree(Points p)
      : points(std::move(p)),
        index(static_cast<int>(points.x.rows()), points,
              nanoflann::KDTreeSingleIndexAdaptorParams(16)) {
    index.buildIndex();
  }
  Points points;
  Index_ index;
};

NearestState::NearestState(const DemoData& demos, const std::vector<Index>& columns,
                           const Normalizer& normalizer)
    : columns_(columns), normalizer_(normalizer) {
  Tree::Points points{Matrix<float>(normalizer.size() + 1, static_cast<Index>(columns.size()))};
  for (Index j = 0; j < points.x.cols(); ++j)
    normalizer.apply(demos.states.col(columns[static_cast<std::size_t>(j)]).data(),
                     points.x.col(j).data());
  tree_ = std::make_unique<Tree>(std::move(points));
}

NearestState::~NearestState() = default;

Index NearestState::find(const float* state) const {
  thread_local std::vector<float> x, distances;
  x.resize(static_cast<std::size_t>(normalizer_.size()) + 1);
  normalizer_.apply(state, x.data());
  std::size_t found = 0;
  float squared_distance = 0;
  nanoflann::KNNResultSet<float> result(1);
  result.init(&found, &squared_distance);
  // What findNeighbors() does, with work space that outlives the call.
  const Tree::Index_& index = tree_->index;
  distances.assign(x.size(), 0);
  const float start = index.computeInitialDistances(index, x.data(), distances);
  index.searchLevel(result, x.data(), index.root_node, start, distances, 1);
  return columns_[found];
}

}  // namespace agail
