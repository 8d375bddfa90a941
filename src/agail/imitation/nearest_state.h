// The nearest demonstrated state, in units of the demonstrations' standard deviation.
#pragma once

#include <memory>
#include <vector>

#include "agail/imitation/demo_data.h"
#include "agail/nn/normalizer.h"

namespace agail {

class NearestState {
 public:
  // Searches among `columns` of the demonstrations. The k-d tree is built once; a look-up is no
  // scan in the few dimensions of a typical robot (with hundreds of dimensions it degrades towards
  // one).
  NearestState(const DemoData& demos, const std::vector<Index>& columns,
               const Normalizer& normalizer);
  ~NearestState();

  // A column of the demonstrations. state: observation_dim values. May be called by several
  // threads.
  Index find(const float* state) const;

 private:
  struct Tree;
  const std::vector<Index>& columns_;
  const Normalizer& normalizer_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace agail
