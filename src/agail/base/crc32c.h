// CRC-32C (Castagnoli), as in iSCSI, RFC 3720, and TensorFlow's record files.
#pragma once

#include <cstdint>
#include <span>

namespace agail {

// Pass an earlier result as `crc` to go on where it ended: crc32c(b, crc32c(a)) == crc32c(ab).
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t crc = 0);

}  // namespace agail
