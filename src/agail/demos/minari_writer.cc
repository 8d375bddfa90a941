#include "agail/demos/minari_writer.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/dataset_location.h"
#include "agail/demos/gymnasium_spec.h"
#include "agail/demos/hdf5.h"
#include "agail/demos/metadata_keys.h"
#include "agail/demos/replace_folder.h"
#include "agail/demos/spaces_json.h"

namespace agail {
namespace {

namespace fs = std::filesystem;
using hdf5::Group;
using hdf5::Type;
using nlohmann::json;
using nlohmann::ordered_json;

// The layout has not changed since, so that older installations read it, too.
constexpr const char* kMinariVersion = "0.5.0";

std::size_t size(Eigen::Index count) { return static_cast<std::size_t>(count); }

void write_real(Group& group, const std::string& name, const std::vector<std::size_t>& shape,
                bool is_float32, const double* values, std::size_t count) {
  if (!is_float32) return group.write(name, shape, Type::kFloat64, values);
  const std::vector<float> narrow(values, values + count);
  group.write(name, shape, Type::kFloat32, narrow.data());
}

void write_actions(Group& group, const DemoEpisode& episode, const Demonstrations& all) {
  const auto count = size(episode.actions.size());
  RowMatrix<double> actions = episode.actions;
  const double missing = all.action.discrete ? 0.0 : std::numeric_limits<double>::quiet_NaN();
  for (Eigen::Index t = 0; t < actions.rows(); ++t)
    for (Eigen::Index k = 0; k < actions.cols(); ++k)
      if (episode.available(t, k) == 0) actions(t, k) = missing;
  if (!all.action.discrete)
    return write_real(group, "actions", {size(actions.rows()), size(actions.cols())},
                      all.actions_are_float32, actions.data(), count);
  const std::vector<std::int64_t> indices(actions.data(), actions.data() + count);
  group.write("actions", {count}, Type::kInt64, indices.data());
}

// T+1 rows, the last one 0. One column if steps are missing whole or not at all, everywhere in the
// file.
void write_mask(Group& group, const DemoEpisode& episode, bool whole_steps) {
  const Eigen::Index columns = whole_steps ? 1 : episode.available.cols();
  RowMatrix<std::uint8_t> mask = RowMatrix<std::uint8_t>::Zero(episode.steps() + 1, columns);
  mask.topRows(episode.steps()) = episode.available.leftCols(columns);
  Group infos = group.create_group("infos");
  std::vector<std::size_t> shape = {size(mask.rows())};
  if (!whole_steps) shape.push_back(size(columns));
  infos.write("action_available", shape, Type::kUint8, mask.data());
}

void write_episode(Group& root, std::size_t index, const Demonstrations& all, bool masked,
                   bool whole_steps) {
  const DemoEpisode& episode = all.episodes[index];
  const std::size_t steps = size(episode.steps());
  Group group = root.create_group("episode_" + std::to_string(index));
  group.write_attribute("id", static_cast<std::int64_t>(index));
  if (episode.seed) group.write_attribute("seed", *episode.seed);
  group.write_attribute("total_steps", static_cast<std::int64_t>(steps));
  write_real(
      group, "observations", {size(episode.observations.rows()), size(episode.observations.cols())},
      all.observations_are_float32, episode.observations.data(), size(episode.observations.size()));
  if (all.action.dim > 0) write_actions(group, episode, all);
  const std::vector<double> unknown(steps, std::numeric_limits<double>::quiet_NaN());
  group.write("rewards", {steps}, Type::kFloat64,
              episode.rewards.empty() ? unknown.data() : episode.rewards.data());
  group.write("terminations", {steps}, Type::kBoolean, episode.terminations.data());
  group.write("truncations", {steps}, Type::kBoolean, episode.truncations.data());
  if (masked) write_mask(group, episode, whole_steps);
}

bool whole_steps_only(const Demonstrations& demonstrations) {
  for (const DemoEpisode& episode : demonstrations.episodes)
    for (Eigen::Index t = 0; t < episode.steps(); ++t)
      if ((episode.available.row(t).array() != episode.available(t, 0)).any()) return false;
  return true;
}

void write_episodes(Group& root, const Demonstrations& demonstrations) {
  const bool masked = demonstrations.action.dim > 0 && demonstrations.missing_ratio() > 0;
  const bool whole_steps = masked && whole_steps_only(demonstrations);
  for (std::size_t i = 0; i < demonstrations.episodes.size(); ++i)
    write_episode(root, i, demonstrations, masked, whole_steps);
}

// The observation space that the source declared (it has the bounds), if it is still true.
std::string observation_space(const json& source, const Demonstrations& demonstrations) {
  const int dim = demonstrations.observation_dim;
  const bool float32 = demonstrations.observations_are_float32;
  if (source.contains("observation_space") && source["observation_space"].is_string()) {
    auto text = source["observation_space"].get<std::string>();
    const json space = space_from_json(text);
    if (space.is_object() && space.value("shape", json()) == json::array({dim}) &&
        space.value("dtype", json()) == (float32 ? "float32" : "float64"))
      return text;
  }
  return observation_space_to_json(dim, float32);
}

ordered_json metadata_of(const Demonstrations& demonstrations) {
  const json source =
      demonstrations.metadata.empty() ? json::object() : json::parse(demonstrations.metadata);
  ordered_json metadata;
  for (const char* key : {"author", "author_email"}) metadata[key] = ordered_json::array();
  for (const char* key : {"algorithm_name", "code_permalink"}) metadata[key] = "";
  for (const auto& [key, value] : source.items())
    if (key != kPatternKey && key != "jpeg_encoding") metadata[key] = value;
  for (const char* key : kListKeys)
    if (metadata.contains(key) && !metadata[key].is_array())
      metadata[key] = ordered_json::array({metadata[key]});

  metadata["total_episodes"] = demonstrations.episodes.size();
  metadata["total_steps"] = demonstrations.transitions();
  metadata["data_format"] = "hdf5";
  metadata["observation_space"] = observation_space(source, demonstrations);
  metadata.erase("action_space");
  if (demonstrations.action.dim > 0)
    metadata["action_space"] =
        action_space_to_json(demonstrations.action, demonstrations.actions_are_float32);
  const std::string& environment = demonstrations.environment;
  // A spec of the source is kept (its arguments may matter) while it is of this environment. An
  // empty one is none.
  bool keeps_spec = false;
  if (source.contains("env_spec") && source["env_spec"].is_string() &&
      !source["env_spec"].get<std::string>().empty()) {
    const json spec = parse_python_json(source["env_spec"].get<std::string>(), "env_spec");
    keeps_spec = spec.is_object() && spec.value("id", json()) == environment;
  }
  if (!keeps_spec) metadata.erase("env_spec");
  if (!keeps_spec && is_gymnasium_id(environment))
    metadata["env_spec"] = gymnasium_spec(environment).dump();
  metadata["minari_version"] = kMinariVersion;
  metadata[kRatioKey] = demonstrations.missing_ratio();
  if (!demonstrations.pattern.empty()) metadata[kPatternKey] = demonstrations.pattern;
  return metadata;
}

void check_key(const std::string& key) {
  constexpr std::size_t kMostBytes = 65534;  // that HDF5 can keep
  if (!key.empty() && key.size() <= kMostBytes && key.find('\0') == std::string::npos) return;
  throw InputError("the metadata have a key of " + std::to_string(key.size()) + " bytes, " +
                   json_text(ordered_json(key.substr(0, 40))) +
                   ", that an HDF5 file cannot keep; rename it, or write a dataset folder");
}

void write_attributes(Group& root, const ordered_json& metadata) {
  constexpr std::uint64_t kMostSigned = std::numeric_limits<std::int64_t>::max();
  for (const auto& [key, value] : metadata.items()) {
    check_key(key);
    if (value.is_string()) {
      root.write_attribute(key, value.get<std::string>());
    } else if (value.is_boolean()) {
      root.write_boolean_attribute(key, value.get<bool>());
    } else if (value.is_number_unsigned() && value.get<std::uint64_t>() > kMostSigned) {
      root.write_attribute(key, value.get<std::uint64_t>());
    } else if (value.is_number_integer()) {
      root.write_attribute(key, value.get<std::int64_t>());
    } else if (value.is_number()) {
      root.write_attribute(key, value.get<double>());
    } else {
      root.write_attribute(key, json_text(value));
    }
  }
}

void write_folder(const Demonstrations& demonstrations, const std::string& path) {
  ordered_json metadata = metadata_of(demonstrations);
  metadata["dataset_id"] = dataset_id_for(path);
  replace_folder(path, [&](const fs::path& folder) {
    fs::create_directory(folder / "data");
    const fs::path data = folder / "data" / "main_data.hdf5";
    write_file_atomically(data, [&](const fs::path& temporary) {
      hdf5::File file = hdf5::File::create(temporary.string());
      write_episodes(file.root(), demonstrations);
      file.close();
    });
    // Megabytes to one decimal, as Minari has it.
    metadata["dataset_size"] = std::round(static_cast<double>(fs::file_size(data)) / 1e5) / 10;
    write_file_atomically(folder / "data" / "metadata.json", json_text(metadata));
  });
}

void write_single_file(const Demonstrations& demonstrations, Group& root) {
  write_attributes(root, metadata_of(demonstrations));
  write_episodes(root, demonstrations);
}

}  // namespace

std::vector<std::uint8_t> encode_demonstrations(const Demonstrations& demonstrations) {
  hdf5::File file = hdf5::File::create_temporary();
  write_single_file(demonstrations, file.root());
  return file.close_and_take();
}

void check_output(const std::string& path) {
  if (!is_single_file(path)) {
    check_replaceable_dataset(path);
    dataset_id_for(path);  // which must have one
    return;
  }
  check_output_folder(fs::path(path).parent_path());
  if (is_there(path) && fs::is_directory(path))
    throw InputError("cannot write " + path + ": it is a folder; give a file name");
}

void write_demonstrations(const Demonstrations& demonstrations, const std::string& path) {
  check_output(path);
  if (!is_single_file(path)) return write_folder(demonstrations, path);
  create_output_folder(fs::path(path).parent_path());
  write_file_atomically(path, [&](const fs::path& temporary) {
    hdf5::File file = hdf5::File::create(temporary.string());
    write_single_file(demonstrations, file.root());
    file.close();
  });
}

}  // namespace agail
