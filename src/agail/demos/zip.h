// What numpy's .npz needs of the ZIP format: stored and deflated members, sizes checked, checksums
// verified.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace agail {

// Name -> contents. Throws InputError, starting with `where`, if this is no ZIP file or a damaged
// one.
std::map<std::string, std::vector<std::uint8_t>> unzip(const std::vector<std::uint8_t>& bytes,
                                                       const std::string& where);

}  // namespace agail
