// Demonstrations from Minari's HDF5 layout, without trust in what the file claims.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "agail/demos/demonstrations.h"

namespace agail {

// `path_or_id`: an HDF5 file, a Minari dataset folder, or the id of a dataset that Minari has on
// this machine.
//
// A missing entry is one that infos/action_available marks 0, or (without that mask) one that is
// NaN; an episode without `actions` misses all of them. The action space is the declared one;
// without a declaration, integers in one column are discrete with n = largest + 1 and anything else
// is an unbounded Box. With neither actions nor a declaration action.dim is 0, for the caller to
// fill from the environment. Missing rewards and flags are allowed. Episodes come in the order of
// their numbers, which may have gaps.
//
// Throws InputError (one line: what, where, how to mend it) for anything that does not fit. Not
// thread-safe (HDF5).
Demonstrations read_demonstrations(const std::string& path_or_id);

// The same from the bytes of an HDF5 file, named `name` in messages.
Demonstrations read_demonstrations(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace agail
