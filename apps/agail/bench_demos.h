// Demonstrations to measure with, of any size.
#pragma once

#include "agail/train/trainer.h"

namespace agail {

// Complete demonstrations for `task`: 100 episodes of its untrained policy. With `transitions` > 0
// just as many steps: the episodes are repeated with a little noise on their states, so that no two
// states are equal.
Demonstrations untrained_demonstrations(const TrainingTask& task, Eigen::Index transitions);

}  // namespace agail
