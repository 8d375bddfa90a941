#include <algorithm>
#include <nlohmann/json.hpp>

#include "agail/train/safetensors.h"
#include "agail/train/safetensors_checksum.h"

namespace agail {
namespace {

using Entry = std::map<std::string, Tensor>::value_type;

// The order of the reference writer: wide types first, so that every array is aligned; then by
// name.
std::vector<const Entry*> in_file_order(const TensorStore& store) {
  std::vector<const Entry*> entries;
  for (const Entry& entry : store.tensors) entries.push_back(&entry);
  std::stable_sort(entries.begin(), entries.end(), [](const Entry* a, const Entry* b) {
    return size_of(a->second.dtype) > size_of(b->second.dtype);
  });
  return entries;
}

}  // namespace

std::vector<std::uint8_t> to_safetensors(const TensorStore& store) {
  const std::vector<const Entry*> entries = in_file_order(store);
  nlohmann::json header = {{"__metadata__", store.metadata}};  // keys come out sorted
  header["__metadata__"][kChecksumKey] = checksum_of(store);
  std::size_t offset = 0;
  for (const Entry* entry : entries) {
    const auto& [name, tensor] = *entry;
    std::size_t size = size_of(tensor.dtype);
    for (const std::size_t n : tensor.shape) size *= n;
    AGAIL_CHECK(size == tensor.bytes.size());
    AGAIL_CHECK(name != "__metadata__");
    header[name] = {{"dtype", name_of(tensor.dtype)},
                    {"shape", tensor.shape},
                    {"data_offsets", {offset, offset + size}}};
    offset += size;
  }
  std::string text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');

  std::vector<std::uint8_t> bytes;
  bytes.reserve(8 + text.size() + offset);
  for (unsigned i = 0; i < 8; ++i)
    bytes.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(text.size()) >> (8 * i)));
  bytes.insert(bytes.end(), text.begin(), text.end());
  for (const Entry* entry : entries)
    bytes.insert(bytes.end(), entry->second.bytes.begin(), entry->second.bytes.end());
  return bytes;
}

}  // namespace agail
