// The C++ policy in a Python one.
#pragma once

#include <nanobind/nanobind.h>

#include "agail/train/saved_policy.h"

namespace agail {

// `policy`: an agail.Policy (else Python's TypeError); lives as long as it does.
const SavedPolicy& saved_policy(nanobind::handle policy);

}  // namespace agail
