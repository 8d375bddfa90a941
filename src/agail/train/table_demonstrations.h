// Step tables to demonstrations of an environment that may be known.
#pragma once

#include <string>

#include "agail/demos/step_table.h"

namespace agail {

// `environment`: a Gymnasium id (InputError if it is none), or empty. If it is one that we can
// make, the demonstrations get its action space, and InputError if sizes do not fit it.
Demonstrations demonstrations_of(StepTable table, const std::string& environment);

}  // namespace agail
