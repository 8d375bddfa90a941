// Step tables from CSV.
#pragma once

#include <string>

#include "agail/demos/step_table.h"

namespace agail {

// The first line names the columns; their order is free:
//   obs_0 ... obs_{D-1}             required
//   action_0 ... action_{A-1}       a continuous action; or `action`, one column: discrete if whole
//   next_obs_0 ... next_obs_{D-1}   optional, as are reward, terminated, truncated, episode
// An empty cell or "nan" is a missing value, allowed in actions and where a row has no step.
// Columns of other names are put into `ignored`. Rows of one `episode` stand together; without that
// column episodes end where terminated or truncated says so. Decimal points, commas between cells.
// Row numbers in messages count from 0, without the header.
StepTable read_csv(const std::string& path, std::vector<std::string>& ignored);

}  // namespace agail
