// Whatever a CSV file or the arrays of a .npz file hold, reading them gives demonstrations or an
// InputError. The .npz file itself is whole: mutations of one would end at its checksums.
#include <fuzzer/FuzzedDataProvider.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/csv_table.h"
#include "agail/demos/minari_writer.h"
#include "agail/demos/npz_table.h"

namespace {

// A number of ZIP's, `width` bytes from the lowest on.
void put(std::string& bytes, std::size_t value, int width) {
  for (int i = 0; i < width; ++i) bytes.push_back(static_cast<char>(value >> 8 * i & 255));
}

struct Member {
  std::string name, contents;
};

std::string zip(const std::vector<Member>& members) {
  std::string bytes, directory;
  for (const Member& member : members) {
    std::string common;  // to the local header and the directory
    put(common, 20, 2);  // version needed
    put(common, 0, 8);   // flags, stored as it is, time, date
    put(common,
        crc32(0, reinterpret_cast<const Bytef*>(member.contents.data()),
              static_cast<uInt>(member.contents.size())),
        4);
    put(common, member.contents.size(), 4);
    put(common, member.contents.size(), 4);
    put(common, member.name.size(), 2);
    put(common, 0, 2);  // further fields
    put(directory, 0x02014b50, 4);
    put(directory, 20, 2);
    directory += common;
    put(directory, 0, 4);  // comment, disk
    put(directory, 0, 6);  // attributes
    put(directory, bytes.size(), 4);
    directory += member.name;
    put(bytes, 0x04034b50, 4);
    bytes += common + member.name + member.contents;
  }
  const std::size_t begin = bytes.size();
  bytes += directory;
  put(bytes, 0x06054b50, 4);
  put(bytes, 0, 4);  // disks
  put(bytes, members.size(), 2);
  put(bytes, members.size(), 2);
  put(bytes, directory.size(), 4);
  put(bytes, begin, 4);
  put(bytes, 0, 2);
  return bytes;
}

// An array as numpy writes it, or any bytes.
std::string array(FuzzedDataProvider& data) {
  if (data.ConsumeIntegralInRange(0, 7) == 0) return data.ConsumeRandomLengthString();
  struct Type {
    const char* name;
    std::size_t width;
  };
  constexpr std::array<Type, 7> kTypes = {
      {{"<f8", 8}, {"<f4", 4}, {"<i8", 8}, {"<i4", 4}, {"|u1", 1}, {"|b1", 1}, {"<f2", 2}}};
  const Type type = data.PickValueInArray(kTypes);
  const auto rows = data.ConsumeIntegralInRange<std::size_t>(0, 9);
  const auto columns = data.ConsumeIntegralInRange<std::size_t>(0, 4);  // 0: a vector
  std::string shape = "(" + std::to_string(rows) + ",";
  if (columns > 0) shape += " " + std::to_string(columns);
  const std::string header = std::string("{'descr': '") + type.name +
                             "', 'fortran_order': False, 'shape': " + shape + "), }\n";
  std::string bytes("\x93NUMPY\x01\x00", 8);
  put(bytes, header.size(), 2);
  bytes += header;
  std::string values =
      data.ConsumeBytesAsString(rows * std::max<std::size_t>(columns, 1) * type.width);
  values.resize(rows * std::max<std::size_t>(columns, 1) * type.width);
  return bytes + values;
}

std::string npz(FuzzedDataProvider& data) {
  constexpr std::array<const char*, 11> kNames = {
      "observations", "actions",     "action_available", "next_observations", "rewards",
      "terminations", "truncations", "episodes",         "episode_starts",    "episode_ends",
      "other"};
  std::vector<Member> members = {{"observations.npy", array(data)}};
  while (data.remaining_bytes() > 0 && members.size() < 8)
    members.push_back({std::string(data.PickValueInArray(kNames)) + ".npy", array(data)});
  return zip(members);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const std::filesystem::path folder = [] {
    std::filesystem::path made =
        std::filesystem::temp_directory_path() / ("read_table_fuzz-" + std::to_string(getpid()));
    std::filesystem::create_directory(made);
    return made;
  }();
  FuzzedDataProvider data(bytes, size);
  const bool is_npz = data.ConsumeBool();
  const std::filesystem::path file = folder / (is_npz ? "input.npz" : "input.csv");
  const std::string contents = is_npz ? npz(data) : data.ConsumeRemainingBytesAsString();
  agail::write_file_atomically(file, std::string_view(contents));
  try {
    std::vector<std::string> ignored;
    const agail::StepTable table =
        is_npz ? agail::read_npz(file.string(), ignored) : agail::read_csv(file.string(), ignored);
    // What can be read can be written.
    agail::encode_demonstrations(agail::demonstrations_from(table, "", {}));
  } catch (const agail::InputError&) {
  }
  return 0;
}
