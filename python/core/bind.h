// The parts of the extension module, one file each.
#pragma once

#include <nanobind/nanobind.h>

namespace agail {

void bind_errors(nanobind::module_& module);
void bind_environments(nanobind::module_& module);
void bind_demonstrations(nanobind::module_& module);
void bind_policy(nanobind::module_& module);
void bind_training(nanobind::module_& module);

}  // namespace agail
