#include <mujoco/mujoco.h>

#include "agail/env/environment.h"

namespace agail {

std::string physics_version() { return mj_versionString(); }

}  // namespace agail
