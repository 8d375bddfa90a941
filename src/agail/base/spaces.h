// Action spaces, known to environments, demonstrations and policies alike.
#pragma once

#include <vector>

namespace agail {

// Box (float32) or Discrete {0, ..., n-1}. In memory a discrete action is one float, the index.
struct ActionSpace {
  bool discrete = false;
  int dim = 0;             // entries of an action; 1 when discrete
  int n = 0;               // number of actions when discrete, else 0
  std::vector<float> low;  // Box only; may be -inf / +inf
  std::vector<float> high;

  // Entries of the one-hot (discrete) or plain (Box) encoding that networks see.
  int encoded_dim() const { return discrete ? n : dim; }
  bool operator==(const ActionSpace&) const = default;
};

}  // namespace agail
