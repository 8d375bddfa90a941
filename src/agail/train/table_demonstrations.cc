#include "agail/train/table_demonstrations.h"

#include "agail/base/error.h"
#include "agail/demos/gymnasium_spec.h"
#include "agail/env/environment.h"

namespace agail {

Demonstrations demonstrations_of(StepTable table, const std::string& environment) {
  if (!environment.empty() && !is_gymnasium_id(environment))
    throw InputError("'" + environment + "' is no Gymnasium id; give one such as Hopper-v5");
  std::optional<ActionSpace> known;
  if (const std::optional<EnvironmentSpec> spec = find_environment_spec(environment)) {
    if (table.observations.cols() != spec->observation_dim)
      throw InputError(table.where + " has observations of " +
                       std::to_string(table.observations.cols()) + " numbers, " + environment +
                       " of " + std::to_string(spec->observation_dim));
    known = spec->action;
    table.observations_are_float32 = spec->observation_is_float32;
  }
  return demonstrations_from(table, environment, known);
}

}  // namespace agail
