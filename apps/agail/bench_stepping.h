// Stepping alone.
#pragma once

#include <nlohmann/json.hpp>

#include "agail/train/trainer.h"

namespace agail {

// Steps the lanes of `task` through `batches` batches of actions drawn uniformly from the action
// space, nothing else, and tells how long a step took. For all ranks together.
nlohmann::ordered_json measure_stepping(const TrainingTask& task, int batches,
                                        Communicator& communicator);

}  // namespace agail
