// Demonstrations in Minari's HDF5 layout.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "agail/demos/demonstrations.h"

namespace agail {

// `path` x.hdf5: one file, the metadata as attributes of its root. Any other name: a Minari dataset
// folder (data/main_data.hdf5, data/metadata.json), which replaces a Minari dataset of that name
// and nothing else. Whole or absent, whatever happens meanwhile. Equal demonstrations give equal
// bytes.
//
// Missing entries are NaN (discrete: 0) and 0 in infos/action_available, which is left out if
// nothing is missing. Without rewards NaN is stored, as Minari needs the dataset; without an action
// space (action.dim 0) there is no `actions`, and Minari's own reader cannot open the file.
//
// Throws InputError if nothing can be written there, SystemError if the machine fails.
void write_demonstrations(const Demonstrations& demonstrations, const std::string& path);

// The same InputError, as far as it can be told before there are demonstrations: so that nobody
// waits for them in vain. Creates nothing.
void check_output(const std::string& path);

// The bytes of the single file.
std::vector<std::uint8_t> encode_demonstrations(const Demonstrations& demonstrations);

}  // namespace agail
