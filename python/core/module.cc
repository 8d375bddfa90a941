// agail._core: what Python needs of the C++ core. The package's Python files are its users; its
// classes that users meet are those that agail/__init__.py names.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "agail/base/build_info.h"
#include "agail/env/environment.h"
#include "bind.h"

NB_MODULE(_core, module) {
  namespace nb = nanobind;
  module.doc() = "The C++ core of agail; use the package agail";
  module.attr("version") = agail::kVersion;
  module.attr("mujoco_version") = agail::physics_version();
  agail::bind_errors(module);
  agail::bind_environments(module);
  agail::bind_demonstrations(module);
  agail::bind_policy(module);
  agail::bind_training(module);
}
