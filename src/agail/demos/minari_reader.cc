#include "agail/demos/minari_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/base/memory_limit.h"
#include "agail/demos/dataset_location.h"
#include "agail/demos/gymnasium_spec.h"
#include "agail/demos/hdf5.h"
#include "agail/demos/metadata_keys.h"
#include "agail/demos/read_episode.h"
#include "agail/demos/spaces_json.h"
#include "agail/demos/trial.h"

namespace agail {
namespace {

using nlohmann::json;

std::string text_of(const json& metadata, const char* key) {
  return metadata.contains(key) && metadata[key].is_string() ? metadata[key].get<std::string>()
                                                             : "";
}

// The metadata of a single file: the attributes of its root, Minari's, ours and whoever's, that are
// one text, number or boolean.
json root_metadata(const hdf5::Group& root) {
  json metadata = json::object();
  for (const std::string& key : root.attribute_names()) {
    if (const auto text = root.text_attribute(key)) metadata[key] = *text;
    if (const auto number = root.integer_attribute(key)) metadata[key] = *number;
    if (const auto number = root.unsigned_attribute(key)) metadata[key] = *number;
    if (const auto number = root.real_attribute(key)) metadata[key] = *number;
    if (const auto flag = root.boolean_attribute(key)) metadata[key] = *flag;
  }
  for (const char* key : kListKeys) {
    const std::string text = text_of(metadata, key);
    if (text.empty()) continue;
    json list = json::parse(text, nullptr, false);
    metadata[key] = list.is_array() ? list : json::array({text});
  }
  return metadata;
}

std::string environment_of(const json& metadata, const std::string& where) {
  const std::string spec = text_of(metadata, "env_spec");
  if (spec.empty()) return "";
  const json parsed = parse_python_json(spec, where + ": env_spec");
  if (!parsed.is_object() || !parsed.contains("id") || !parsed["id"].is_string() ||
      !is_gymnasium_id(parsed["id"].get<std::string>()))
    throw InputError(
        where +
        ": env_spec names no environment; its \"id\" must be a Gymnasium id such as Hopper-v5");
  return parsed["id"].get<std::string>();
}

// The episode groups in the order of their numbers.
std::vector<std::string> episode_names(const hdf5::Group& root) {
  std::vector<std::pair<std::uint64_t, std::string>> numbered;
  for (const std::string& name : root.names()) {
    constexpr std::string_view kPrefix = "episode_";
    if (!name.starts_with(kPrefix)) continue;
    const hdf5::Kind kind = root.kind(name);
    std::uint64_t number = 0;
    const char* end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(name.data() + kPrefix.size(), end, number);
    if (error != std::errc{} || stop != end) {
      const std::string rest = name.substr(kPrefix.size());
      const bool numeric = rest.empty() || rest.find_first_of("+-0123456789") == 0;
      if (kind == hdf5::Kind::kDataset || !numeric) continue;  // somebody's own, no episode
      throw InputError(root.where(name) +
                       " is no episode number; name the groups episode_0, episode_1, ...");
    }
    if (kind != hdf5::Kind::kGroup)
      throw InputError(root.where(name) + " is not a group of datasets");
    numbered.emplace_back(number, name);
  }
  std::sort(numbered.begin(), numbered.end());
  std::vector<std::string> names;
  for (auto& [number, name] : numbered) names.push_back(std::move(name));
  return names;
}

// As text, without a fraction.
std::string whole_number(double value) {
  const std::string text = std::to_string(value);
  return text.substr(0, text.find('.'));
}

// The declared space, or what the numbers look like.
ActionSpace action_space_of(const std::vector<RawEpisode>& episodes, const json& metadata,
                            const std::string& where) {
  const std::string declared = text_of(metadata, "action_space");
  if (!declared.empty()) return action_space_from_json(declared, where + ": action_space");
  ActionSpace space;
  bool integers = true;
  double largest = 0;
  for (const RawEpisode& episode : episodes) {
    if (!episode.actions) continue;
    const auto columns = static_cast<int>(episode.actions->cols());
    if (space.dim != 0 && columns != space.dim)
      throw InputError(episode.where + "/actions has " + std::to_string(columns) +
                       " entries a step, those before " + std::to_string(space.dim));
    space.dim = columns;
    integers = integers && episode.actions_are_integers;
    // What stands in for a missing action says nothing.
    for (Eigen::Index t = 0; t < episode.steps(); ++t)
      if (!episode.available || (*episode.available)(t, 0) == 1)
        largest = std::max(largest, (*episode.actions)(t, 0));
  }
  if (space.dim == 0) return space;
  if (integers && space.dim == 1) {
    if (largest >= 65536)
      throw InputError(where + ": the discrete action " + whole_number(largest) +
                       " is too large; the largest allowed is 65535");
    space.discrete = true;
    space.n = static_cast<int>(largest) + 1;
  } else {
    space.low.assign(static_cast<std::size_t>(space.dim), -std::numeric_limits<float>::infinity());
    space.high.assign(static_cast<std::size_t>(space.dim), std::numeric_limits<float>::infinity());
  }
  return space;
}

void check_discrete(const RawEpisode& raw, Eigen::Index t, double action,
                    const ActionSpace& space) {
  if (action >= 0 && action < space.n && std::floor(action) == action) return;
  throw InputError(raw.where + "/actions: step " + std::to_string(t) + " has the action " +
                   json(action).dump() + "; the actions are the whole numbers from 0 to " +
                   std::to_string(space.n - 1));
}

DemoEpisode finish(RawEpisode raw, const ActionSpace& space) {
  const Eigen::Index steps = raw.steps();
  if (raw.actions && raw.actions->cols() != space.dim)
    throw InputError(raw.where + "/actions has " + std::to_string(raw.actions->cols()) +
                     " entries a step, the action space of the file " + std::to_string(space.dim));
  DemoEpisode episode = std::move(raw.rest);
  episode.observations = std::move(raw.observations);
  const double missing = space.discrete ? 0.0 : std::numeric_limits<double>::quiet_NaN();
  episode.available.setZero(steps, space.dim);
  if (!raw.actions) {
    episode.actions.setConstant(steps, space.dim, missing);
    return episode;
  }
  episode.actions = std::move(*raw.actions);
  for (Eigen::Index t = 0; t < steps; ++t) {
    for (Eigen::Index k = 0; k < space.dim; ++k) {
      double& action = episode.actions(t, k);
      const bool known =
          !std::isnan(action) &&
          (!raw.available || (*raw.available)(t, raw.available->cols() == 1 ? 0 : k) == 1);
      if (known && space.discrete) check_discrete(raw, t, action, space);
      if (!known) action = missing;
      episode.available(t, k) = known ? 1 : 0;
    }
  }
  return episode;
}

// A number of a Discrete space becomes a row that is 1 in its place, as environments with such a
// space give it.
void make_one_hot(RawEpisode& episode, const DiscreteSpace& space) {
  const RowMatrix<double> numbers = std::move(episode.observations);
  episode.observations.setZero(numbers.rows(), space.n);
  episode.observations_are_float32 = true;
  for (Eigen::Index t = 0; t < numbers.rows(); ++t) {
    const double place = numbers(t, 0) - static_cast<double>(space.start);
    if (!(place >= 0 && place < space.n && std::floor(place) == place))
      throw InputError(
          episode.where + "/observations: row " + std::to_string(t) + " has " +
          json(numbers(t, 0)).dump() + "; the observation space has the whole numbers from " +
          std::to_string(space.start) + " to " + std::to_string(space.start + space.n - 1));
    episode.observations(t, static_cast<Eigen::Index>(place)) = 1;
  }
}

// Demonstrations are held in memory; whether they fit is found out before anything is read.
void check_memory(const hdf5::Group& root, const std::vector<std::string>& names,
                  const std::optional<DiscreteSpace>& discrete) {
  std::uint64_t kept = 0, passing = 0;
  for (const std::string& name : names) {
    const EpisodeMemory memory = memory_of_episode(root.group(name));
    kept += memory.kept;
    if (discrete) kept += sizeof(double) * memory.observations * static_cast<unsigned>(discrete->n);
    passing = std::max(passing, memory.passing);
  }
  require_memory(kept + passing, root.where());
}

Demonstrations read(const hdf5::Group& root, const json& metadata, const std::string& where) {
  const std::vector<std::string> names = episode_names(root);
  if (names.empty()) {
    const bool flat = root.kind("observations") == hdf5::Kind::kDataset;
    throw InputError(root.where() + " holds no episodes (groups episode_0, episode_1, ...)" +
                     (flat ? ", but one array of observations, as D4RL's files do; "
                             "agail.Demonstrations.from_d4rl() in Python reads those"
                           : ""));
  }
  if (metadata.contains("total_episodes") && metadata["total_episodes"] != names.size())
    throw InputError(where + " says there are " + json_text(metadata["total_episodes"]) +
                     " episodes, the file holds " + std::to_string(names.size()) +
                     "; it is incomplete, copy or record it again");
  const std::optional<DiscreteSpace> discrete = discrete_space_from_json(
      text_of(metadata, "observation_space"), where + ": observation_space");
  check_memory(root, names, discrete);

  Demonstrations demonstrations;
  demonstrations.environment = environment_of(metadata, where);
  demonstrations.pattern = text_of(metadata, kPatternKey);
  demonstrations.observations_are_float32 = true;
  std::vector<RawEpisode> episodes;
  bool any_actions = false;
  bool float32 = true;
  for (const std::string& name : names) {
    episodes.push_back(read_episode(root.group(name)));
    RawEpisode& episode = episodes.back();
    if (discrete && episode.observations.cols() == 1) make_one_hot(episode, *discrete);
    if (episode.observations.cols() != episodes.front().observations.cols())
      throw InputError(
          episode.where + "/observations has " + std::to_string(episode.observations.cols()) +
          " entries a step, those before " + std::to_string(episodes.front().observations.cols()));
    demonstrations.observations_are_float32 &= episode.observations_are_float32;
    any_actions = any_actions || episode.actions;
    float32 = float32 &&
              (!episode.actions || episode.actions_are_float32 || episode.actions_are_integers);
  }
  demonstrations.observation_dim = static_cast<int>(episodes.front().observations.cols());
  demonstrations.action = action_space_of(episodes, metadata, where);
  demonstrations.actions_are_float32 = !any_actions || float32;
  for (RawEpisode& episode : episodes)
    demonstrations.episodes.push_back(finish(std::move(episode), demonstrations.action));
  if (!metadata.empty()) demonstrations.metadata = json_text(metadata);
  return demonstrations;
}

// Many times what any sound file takes; what takes longer goes round in circles.
unsigned patience(std::uintmax_t bytes) { return 5 + 2 * static_cast<unsigned>(bytes >> 20); }

[[noreturn]] void damaged(const std::string& where) {
  throw InputError(where + " is damaged so that it cannot be read; copy or record it again");
}

Demonstrations read_file_at(const DatasetLocation& location) {
  json metadata;
  if (!location.metadata.empty()) {
    const std::vector<std::uint8_t> bytes = read_file(location.metadata, std::size_t{64} << 20);
    metadata = parse_python_json(std::string(bytes.begin(), bytes.end()), location.metadata);
    if (!metadata.is_object())
      throw InputError(location.metadata + " is not a JSON object, so no metadata of Minari's");
  }
  hdf5::File file = hdf5::File::open(location.data);
  if (location.metadata.empty()) metadata = root_metadata(file.root());
  return read(file.root(), metadata, location.metadata.empty() ? location.data : location.metadata);
}

Demonstrations read_bytes(std::span<const std::uint8_t> bytes, const std::string& name) {
  hdf5::File file = hdf5::File::from_image(bytes, name);
  const json metadata = root_metadata(file.root());
  return read(file.root(), metadata, name);
}

}  // namespace

Demonstrations read_demonstrations(const std::string& path_or_id) {
  const DatasetLocation location = locate_dataset(path_or_id);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(location.data, error);
  if (!error && !survives_trial([&] { read_file_at(location); }, patience(size)))
    damaged(location.data);
  return read_file_at(location);
}

Demonstrations read_demonstrations(std::span<const std::uint8_t> bytes, const std::string& name) {
  if (!survives_trial([&] { read_bytes(bytes, name); }, patience(bytes.size()))) damaged(name);
  return read_bytes(bytes, name);
}

}  // namespace agail
