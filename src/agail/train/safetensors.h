// TensorStore <-> the safetensors format: 8 bytes header length, a JSON header, the arrays' bytes.
// https://github.com/huggingface/safetensors#format
//
// On top of the format, `__metadata__` has "checksum": "crc32c:" and 8 hex digits over names,
// types, shapes, values and the other metadata. It does not depend on the layout of the file, so a
// tool that keeps arrays and metadata keeps it valid.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "agail/base/archive.h"

namespace agail {

enum class Checksum {
  kRequired,   // what agail wrote: policies, checkpoints
  kIfPresent,  // files of other programs
};

// Equal stores give equal bytes.
std::vector<std::uint8_t> to_safetensors(const TensorStore& store);

// Refuses anything that the format does not allow, and types other than F32 F64 I64 U8: InputError,
// one line that begins with `where` (the file's name). The checksum is verified and left out of the
// result.
TensorStore from_safetensors(std::span<const std::uint8_t> bytes, const std::string& where,
                             Checksum checksum);

}  // namespace agail
