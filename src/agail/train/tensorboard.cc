#include "agail/train/tensorboard.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>
#include <system_error>

#include "agail/base/crc32c.h"
#include "agail/base/error.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "events.out.tfevents.";

// Protocol buffer fields: key = number * 8 + wire type (0 varint, 1 eight bytes, 2 length, 5 four
// bytes).
template <class Unsigned>
std::string little_endian(Unsigned value) {
  std::string out;
  for (unsigned i = 0; i < sizeof value; ++i) out += static_cast<char>(value >> (8 * i));
  return out;
}

std::string varint(std::uint64_t value) {
  std::string out;
  for (; value >= 0x80; value >>= 7) out += static_cast<char>((value & 0x7f) | 0x80);
  return out + static_cast<char>(value);
}

std::string key(std::uint64_t number, std::uint64_t wire_type) {
  return varint(number * 8 + wire_type);
}
std::string int_field(unsigned number, std::int64_t value) {
  return key(number, 0) + varint(static_cast<std::uint64_t>(value));
}
std::string double_field(unsigned number, double value) {
  return key(number, 1) + little_endian(std::bit_cast<std::uint64_t>(value));
}
std::string float_field(unsigned number, float value) {
  return key(number, 5) + little_endian(std::bit_cast<std::uint32_t>(value));
}
std::string bytes_field(unsigned number, std::string_view value) {
  return key(number, 2) + varint(value.size()) + std::string(value);
}

// event.proto and summary.proto of TensorFlow.
std::string wall_time_field() {
  const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
  return double_field(1, now.count());
}
std::string step_field(std::int64_t step) { return int_field(2, step); }
std::string file_version_field() { return bytes_field(3, "brain.Event:2"); }
std::string summary_value(std::string_view tag, float value) {
  return bytes_field(1, bytes_field(1, tag) + float_field(2, value));
}
std::string summary_field(std::string_view values) { return bytes_field(5, values); }
std::string session_start_field() { return bytes_field(7, int_field(1, 1)); }

std::uint32_t masked_crc(std::string_view bytes) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const std::uint32_t crc = crc32c(std::span(data, bytes.size()));
  return ((crc >> 15) | (crc << 17)) + 0xa282ead8U;
}

std::string record(std::string_view payload) {
  const std::string length = little_endian(static_cast<std::uint64_t>(payload.size()));
  return length + little_endian(masked_crc(length)) + std::string(payload) +
         little_endian(masked_crc(payload));
}

// TensorBoard reads the files of a folder in the order of their names, which begin with the second
// of their creation: take a later one than every file has that is there.
std::int64_t creation_time(const fs::path& folder) {
  auto time = static_cast<std::int64_t>(std::chrono::duration_cast<std::chrono::seconds>(
                                            std::chrono::system_clock::now().time_since_epoch())
                                            .count());
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    std::int64_t other = 0;
    if (name.starts_with(kPrefix) &&
        std::from_chars(name.data() + kPrefix.size(), name.data() + name.size(), other).ec ==
            std::errc())
      time = std::max(time, other + 1);
  }
  return time;
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "localhost";
}

}  // namespace

TensorBoardWriter::TensorBoardWriter(const fs::path& folder,
                                     std::optional<std::int64_t> resume_step) {
  path_ = folder / (std::string(kPrefix) + std::to_string(creation_time(folder)) + "." +
                    host_name() + "." + std::to_string(::getpid()));
  file_.reset(std::fopen(path_.c_str(), "wbx"));
  if (!file_) throw SystemError("cannot create " + path_.string() + ": " + std::strerror(errno));
  write_event(file_version_field());
  // A start at step n purges steps from n on; the checkpoint's own step stays.
  if (resume_step) write_event(step_field(*resume_step + 1) + session_start_field());
  flush();
}

void TensorBoardWriter::scalars(std::int64_t step,
                                std::span<const std::pair<std::string_view, double>> values) {
  std::string summary;
  for (const auto& [tag, value] : values)
    if (!std::isnan(value)) summary += summary_value(tag, static_cast<float>(value));
  if (!summary.empty()) write_event(step_field(step) + summary_field(summary));
}

void TensorBoardWriter::flush() {
  if (std::fflush(file_.get()) != 0)
    throw SystemError("cannot write " + path_.string() + ": " + std::strerror(errno));
}

void TensorBoardWriter::write_event(const std::string& fields) {
  write(record(wall_time_field() + fields));
}

void TensorBoardWriter::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    throw SystemError("cannot write " + path_.string() + ": " + std::strerror(errno));
}

}  // namespace agail
