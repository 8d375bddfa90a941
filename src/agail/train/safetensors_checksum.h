#pragma once

#include <string>

#include "agail/base/archive.h"

namespace agail {

inline constexpr const char* kChecksumKey = "checksum";

// "crc32c:" and 8 hex digits over everything in the store but an entry kChecksumKey.
std::string checksum_of(const TensorStore& store);

}  // namespace agail
