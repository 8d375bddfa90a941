// The units in which policies learn to act.
#pragma once

#include "agail/rl/policy_network.h"

namespace agail {

// The action within the bounds of `space`.
void clip_action(const ActionSpace& space, const float* sampled, float* executed);

// Networks, exploration noise and step sizes are made for numbers about 1; an environment's actions
// may be percent, newtons or a register's 0 to 255. So learners see u = (a - centre) / scale, in
// which a dimension's bounds are -1 and 1. Bounds that are symmetric and from 1/4 to 1 (those of
// all built-in environments) are taken as they are, and so is a dimension without bounds: u = a.
class ActionUnits {
 public:
  explicit ActionUnits(const ActionSpace& space);

  // The environment's action space in these units.
  const ActionSpace& space() const { return space_; }

  // What the environment executes for u: a within its bounds. Both: dim numbers; may be the same.
  void execute(const float* u, float* a) const;

  // Entry i of a demonstrated action, in these units and within the bounds: a policy's actions,
  // which are compared with it, are executed within them, too.
  float from_environment(Index i, float a) const;

  // The same policy, which takes u (parameters theta), with outputs in the environment's units:
  // scale and centre become part of its last layer and of log_std.
  Vector<float> in_environment(const PolicyNetwork<float>& network, Vector<float> theta) const;

 private:
  struct Unit {
    double centre = 0, scale = 1;
    bool own = true;  // the environment's: nothing is to be done
  };
  ActionSpace environment_, space_;
  std::vector<Unit> units_;  // of each entry
};

}  // namespace agail
