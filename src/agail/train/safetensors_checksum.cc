#include "agail/train/safetensors_checksum.h"

#include <array>
#include <cstdio>
#include <string_view>

#include "agail/base/crc32c.h"

namespace agail {
namespace {

// Numbers as 8 bytes, little-endian; texts and arrays with their length before them, so that no two
// different stores give the same sequence of bytes.
class Digest {
 public:
  void number(std::uint64_t value) {
    std::array<std::uint8_t, 8> bytes;
    for (unsigned i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
    crc_ = crc32c(bytes, crc_);
  }
  void bytes(std::span<const std::uint8_t> values) {
    number(values.size());
    crc_ = crc32c(values, crc_);
  }
  void text(std::string_view value) {
    bytes(std::span(reinterpret_cast<const std::uint8_t*>(value.data()), value.size()));
  }
  std::uint32_t value() const { return crc_; }

 private:
  std::uint32_t crc_ = 0;
};

}  // namespace

std::string checksum_of(const TensorStore& store) {
  Digest digest;
  digest.number(store.tensors.size());
  for (const auto& [name, tensor] : store.tensors) {
    digest.text(name);
    digest.text(name_of(tensor.dtype));
    digest.number(tensor.shape.size());
    for (const std::size_t size : tensor.shape) digest.number(size);
    digest.bytes(tensor.bytes);
  }
  for (const auto& [key, value] : store.metadata) {
    if (key == kChecksumKey) continue;
    digest.text(key);
    digest.text(value);
  }
  std::array<char, 9> hex;
  std::snprintf(hex.data(), hex.size(), "%08x", digest.value());
  return std::string("crc32c:") + hex.data();
}

}  // namespace agail
