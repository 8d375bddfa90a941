// Whatever a CSV file or the arrays of a .npz file hold, reading them gives demonstrations or an
// InputError. The .npz file itself is whole: mutations of one would end at its checksums.
#include <fuzzer/FuzzedDataProvider.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/csv_table.h"
#include "agail/demos/minari_writer.h"
#include "agail/demos/npz_table.h"
#include "demos/npz_bytes.h"

namespace {

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
  const std::string shape =
      "(" + std::to_string(rows) + "," + (columns > 0 ? " " + std::to_string(columns) : "") + ")";
  std::string values =
      data.ConsumeBytesAsString(rows * std::max<std::size_t>(columns, 1) * type.width);
  values.resize(rows * std::max<std::size_t>(columns, 1) * type.width);
  return agail::npy(type.name, shape, values);
}

std::string npz(FuzzedDataProvider& data) {
  constexpr std::array<const char*, 11> kNames = {
      "observations", "actions",     "action_available", "next_observations", "rewards",
      "terminations", "truncations", "episodes",         "episode_starts",    "episode_ends",
      "other"};
  std::vector<std::pair<std::string, std::string>> members = {{"observations.npy", array(data)}};
  while (data.remaining_bytes() > 0 && members.size() < 8)
    members.push_back({std::string(data.PickValueInArray(kNames)) + ".npy", array(data)});
  return agail::zip(members);
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
