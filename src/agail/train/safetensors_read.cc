#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "agail/train/safetensors.h"
#include "agail/train/safetensors_checksum.h"

namespace agail {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxHeader = 100'000'000;  // the reference reader's limit
constexpr const char* kDamaged = "; the file is damaged: copy or train it again";

struct Span {  // where an array's bytes are, counted from the end of the header
  std::size_t begin = 0;
  std::size_t end = 0;
  std::string name;
};

class Reader {
 public:
  Reader(std::span<const std::uint8_t> bytes, const std::string& where)
      : bytes_(bytes), where_(where) {}

  TensorStore read() {
    const json header = read_header();
    for (const auto& [name, entry] : header.items()) {
      if (name == "__metadata__")
        read_metadata(entry);
      else
        read_tensor(name, entry);
    }
    check_layout();
    return std::move(store_);
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(where_ + ": " + what + kDamaged);
  }

 private:
  json read_header() {
    if (bytes_.size() < 8) fail("not a safetensors file (shorter than 8 bytes)");
    std::uint64_t length = 0;
    for (unsigned i = 0; i < 8; ++i) length |= static_cast<std::uint64_t>(bytes_[i]) << (8 * i);
    if (length > bytes_.size() - 8 || length > kMaxHeader)
      fail("not a safetensors file, or cut short (header of " + std::to_string(length) +
           " bytes in a file of " + std::to_string(bytes_.size()) + ")");
    const auto text = bytes_.subspan(8, static_cast<std::size_t>(length));
    data_ = bytes_.subspan(8 + static_cast<std::size_t>(length));
    json header;
    try {
      header = json::parse(text.begin(), text.end(), refuse_duplicates());
    } catch (const json::parse_error& error) {
      fail("the header is not JSON (byte " + std::to_string(error.byte) + ")");
    } catch (const json::exception&) {  // a number that is too large
      fail("the header is not JSON that can be read");
    }
    if (!header.is_object()) fail("the header is not a JSON object");
    return header;
  }

  // JSON parsers keep one of several equal keys and say nothing. Ours also refuses deep nesting.
  json::parser_callback_t refuse_duplicates() {
    return [this, keys = std::vector<std::set<std::string>>()](int depth, json::parse_event_t event,
                                                               json& parsed) mutable {
      if (depth > 3) fail("the header is nested too deeply");
      if (event == json::parse_event_t::object_start) keys.emplace_back();
      if (event == json::parse_event_t::object_end) keys.pop_back();
      if (event == json::parse_event_t::key) {
        const auto key = parsed.get<std::string>();
        if (!keys.back().insert(key).second) fail("the header has '" + key + "' twice");
      }
      return true;
    };
  }

  void read_metadata(const json& entry) {
    if (!entry.is_object()) fail("__metadata__ is not a JSON object");
    for (const auto& [key, value] : entry.items()) {
      if (!value.is_string()) fail("__metadata__ '" + key + "' is not a text");
      store_.metadata[key] = value.get<std::string>();
    }
  }

  void read_tensor(const std::string& name, const json& entry) {
    const std::string who = "array '" + name + "' ";
    if (!entry.is_object() || entry.size() != 3 || !entry.contains("dtype") ||
        !entry.contains("shape") || !entry.contains("data_offsets"))
      fail(who + "has not exactly dtype, shape and data_offsets");
    Tensor tensor;
    tensor.dtype = read_dtype(who, entry["dtype"]);
    tensor.shape = read_sizes(who + "shape", entry["shape"]);
    const std::vector<std::size_t> offsets =
        read_sizes(who + "data_offsets", entry["data_offsets"]);
    if (offsets.size() != 2 || offsets[0] > offsets[1] || offsets[1] > data_.size())
      fail(who + "lies outside the file");
    if (offsets[1] - offsets[0] != bytes_of(who, tensor))
      fail(who + "has another size than its shape says");
    const auto values = data_.subspan(offsets[0], offsets[1] - offsets[0]);
    tensor.bytes.assign(values.begin(), values.end());
    store_.tensors.emplace(name, std::move(tensor));
    spans_.push_back({offsets[0], offsets[1], name});
  }

  DType read_dtype(const std::string& who, const json& entry) const {
    for (const DType type : {DType::kF32, DType::kF64, DType::kI64, DType::kU8})
      if (entry == name_of(type)) return type;
    throw InputError(where_ + ": " + who + "has type " + entry.dump() +
                     "; convert it to F32, F64, I64 or U8");
  }

  std::vector<std::size_t> read_sizes(const std::string& what, const json& entry) const {
    if (!entry.is_array()) fail(what + " is not a list");
    std::vector<std::size_t> sizes;
    for (const json& value : entry) {
      if (!value.is_number_unsigned()) fail(what + " has an entry that is no size");
      sizes.push_back(value.get<std::size_t>());
    }
    return sizes;
  }

  std::size_t bytes_of(const std::string& who, const Tensor& tensor) const {
    std::size_t size = size_of(tensor.dtype);
    for (const std::size_t n : tensor.shape) {
      if (n != 0 && size > std::numeric_limits<std::size_t>::max() / n)
        fail(who + "has a shape that overflows");
      size *= n;
    }
    return size;
  }

  // The arrays must fill the file: no gap, no overlap, nothing behind the last.
  void check_layout() {
    std::sort(spans_.begin(), spans_.end(), [](const Span& a, const Span& b) {
      return std::pair(a.begin, a.end) < std::pair(b.begin, b.end);
    });
    std::size_t position = 0;
    for (const Span& span : spans_) {
      if (span.begin != position) fail("gap or overlap before array '" + span.name + "'");
      position = span.end;
    }
    if (position != data_.size()) fail("bytes behind the last array");
  }

  std::span<const std::uint8_t> bytes_;
  const std::string& where_;
  std::span<const std::uint8_t> data_;
  TensorStore store_;
  std::vector<Span> spans_;
};

}  // namespace

TensorStore from_safetensors(std::span<const std::uint8_t> bytes, const std::string& where,
                             Checksum checksum) {
  Reader reader(bytes, where);
  TensorStore store = reader.read();
  const auto noted = store.metadata.find(kChecksumKey);
  if (noted == store.metadata.end()) {
    if (checksum == Checksum::kRequired)
      throw InputError(where +
                       ": has no checksum, so agail did not write it; give a file of agail's");
  } else {
    if (noted->second != checksum_of(store)) reader.fail("the checksum does not match");
    store.metadata.erase(noted);
  }
  return store;
}

}  // namespace agail
