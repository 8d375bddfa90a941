#include "agail/demos/read_episode.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "agail/base/error.h"

namespace agail {
namespace {

using hdf5::Group;
using hdf5::Kind;

std::string text_of(const std::vector<std::size_t>& shape) {
  std::string text = "(";
  for (const std::size_t size : shape) text += (text.size() > 1 ? ", " : "") + std::to_string(size);
  return text + ")";
}

struct Table {
  RowMatrix<double> values;  // a vector is a table of one column
  hdf5::DatasetInfo info;
};

Table read_table(const Group& group, const std::string& name) {
  const std::string where = group.where(name);
  switch (group.kind(name)) {
    case Kind::kDataset:
      break;
    case Kind::kNothing:
      throw InputError(where + " is missing; Minari's layout needs it");
    case Kind::kGroup:
      throw InputError(where +
                       " is a group (a Dict or Tuple space); flatten it into one vector a step");
    case Kind::kOther:
      throw InputError(where + " is a link or no dataset; store the numbers themselves");
  }
  Table table;
  table.info = group.describe(name);
  const std::vector<std::size_t>& shape = table.info.shape;
  if (shape.empty() || shape.size() > 2)
    throw InputError(where + " has shape " + text_of(shape) +
                     "; expected one row a step, each a vector (flatten it)");
  const std::size_t columns = shape.size() == 1 ? 1 : shape[1];
  if (columns == 0 || columns > (std::size_t{1} << 20))
    throw InputError(where + " has shape " + text_of(shape) +
                     "; its rows must have 1 to 1048576 entries");
  table.values.resize(static_cast<Eigen::Index>(shape[0]), static_cast<Eigen::Index>(columns));
  group.read(name, {table.values.data(), static_cast<std::size_t>(table.values.size())});
  return table;
}

// A vector of T values, or (T, 1).
RowMatrix<double> read_column(const Group& group, const std::string& name, Eigen::Index steps) {
  Table table = read_table(group, name);
  if (table.values.rows() != steps || table.values.cols() != 1)
    throw InputError(group.where(name) + " has shape " + text_of(table.info.shape) +
                     "; expected (" + std::to_string(steps) + "), one value a step");
  return std::move(table.values);
}

[[noreturn]] void refuse_beyond_float32(const std::string& where, Eigen::Index row) {
  throw InputError(where + ": a number in row " + std::to_string(row) +
                   " is too large for float32; use other units");
}

void read_observations(const Group& group, RawEpisode& episode) {
  Table table = read_table(group, "observations");
  if (table.values.rows() < 2)
    throw InputError(group.where("observations") + " has " + std::to_string(table.values.rows()) +
                     " rows, so the episode has no step; leave the episode out");
  if (!table.values.allFinite())
    throw InputError(group.where("observations") +
                     " has NaN or infinite entries; only actions may be missing");
  const Eigen::Index beyond = first_row_beyond_float32(table.values);
  if (beyond >= 0) refuse_beyond_float32(group.where("observations"), beyond);
  episode.observations = std::move(table.values);
  episode.observations_are_float32 =
      table.info.number == hdf5::Number::kReal && table.info.bytes == 4;
}

void read_actions(const Group& group, RawEpisode& episode) {
  if (group.kind("actions") == Kind::kNothing) return;
  Table table = read_table(group, "actions");
  const std::string where = group.where("actions");
  if (table.values.rows() != episode.steps())
    throw InputError(
        where + " has " + std::to_string(table.values.rows()) + " rows and observations " +
        std::to_string(episode.observations.rows()) +
        "; there must be one more observation than actions (the state after the last action)");
  if (table.values.array().isInf().any())
    throw InputError(where + " has infinite entries; mark a missing action with NaN");
  episode.actions_are_integers = table.info.number != hdf5::Number::kReal;
  episode.actions_are_float32 = !episode.actions_are_integers && table.info.bytes == 4;
  episode.actions = std::move(table.values);
}

void read_mask(const Group& group, RawEpisode& episode) {
  const Kind kind = group.kind("infos");
  if (kind == Kind::kNothing) return;
  if (kind != Kind::kGroup)  // there may be a mask behind it
    throw InputError(group.where("infos") + " is a link or no group; store the group itself");
  const Group infos = group.group("infos");
  if (infos.kind("action_available") == Kind::kNothing) return;
  const Table table = read_table(infos, "action_available");
  const std::string where = infos.where("action_available");
  const Eigen::Index steps = episode.steps();
  const Eigen::Index columns = table.values.cols();
  const bool columns_fit = columns == 1 || !episode.actions || columns == episode.actions->cols();
  // Minari's infos have T+1 rows. The last belongs to no action, so it is not looked at and may be
  // absent.
  if ((table.values.rows() != steps + 1 && table.values.rows() != steps) || !columns_fit)
    throw InputError(where + " has shape " + text_of(table.info.shape) + "; expected " +
                     std::to_string(steps + 1) +
                     " rows of one entry, or of one an action dimension");
  const auto mask = table.values.topRows(steps);
  if (!((mask.array() == 0) || (mask.array() == 1)).all())
    throw InputError(where + " has values other than 0 (missing) and 1 (known)");
  if (!episode.actions) return;
  for (Eigen::Index t = 0; t < steps; ++t)
    for (Eigen::Index k = 0; k < episode.actions->cols(); ++k)
      if (std::isnan((*episode.actions)(t, k)) && mask(t, columns == 1 ? 0 : k) == 1)
        throw InputError(where + " says 1 (known) for step " + std::to_string(t) +
                         ", where the action is NaN; set it to 0");
  episode.available = mask.cast<std::uint8_t>();
}

// What stands in for a missing action may be anything.
void check_known_actions(const Group& group, const RawEpisode& episode) {
  if (!episode.actions) return;
  for (Eigen::Index t = 0; t < episode.steps(); ++t)
    for (Eigen::Index k = 0; k < episode.actions->cols(); ++k) {
      const bool known = !episode.available ||
                         (*episode.available)(t, episode.available->cols() == 1 ? 0 : k) == 1;
      if (known && std::abs((*episode.actions)(t, k)) > std::numeric_limits<float>::max())
        refuse_beyond_float32(group.where("actions"), t);
    }
}

void read_rewards(const Group& group, RawEpisode& episode) {
  if (group.kind("rewards") == Kind::kNothing) return;
  const RowMatrix<double> rewards = read_column(group, "rewards", episode.steps());
  // What we write for "none", because Minari needs the dataset.
  if (rewards.array().isNaN().all()) return;
  if (!rewards.allFinite())
    throw InputError(group.where("rewards") +
                     " has NaN or infinite entries; remove the dataset if rewards are unknown");
  episode.rest.rewards.assign(rewards.data(), rewards.data() + rewards.size());
}

std::vector<std::uint8_t> read_flags(const Group& group, const std::string& name,
                                     Eigen::Index steps) {
  std::vector<std::uint8_t> flags(static_cast<std::size_t>(steps), 0);
  if (group.kind(name) == Kind::kNothing) return flags;
  const RowMatrix<double> values = read_column(group, name, steps);
  if (!((values.array() == 0) || (values.array() == 1)).all())
    throw InputError(group.where(name) + " has values other than 0 and 1");
  for (std::size_t t = 0; t < flags.size(); ++t)
    flags[t] = values(static_cast<Eigen::Index>(t), 0) == 1;
  return flags;
}

std::uint64_t entries(const Group& group, const std::string& name) {
  if (group.kind(name) != Kind::kDataset) return 0;
  std::uint64_t count = 1;
  for (const std::size_t size : group.describe(name).shape) count *= size;
  return count;
}

}  // namespace

EpisodeMemory memory_of_episode(const Group& group) {
  constexpr std::uint64_t kNumber = sizeof(double), kFlag = sizeof(std::uint8_t);
  const std::uint64_t actions = entries(group, "actions");
  const std::uint64_t rewards = entries(group, "rewards");
  const std::uint64_t flags = entries(group, "terminations") + entries(group, "truncations");
  const bool has_infos = group.kind("infos") == Kind::kGroup;
  const std::uint64_t mask = has_infos ? entries(group.group("infos"), "action_available") : 0;
  EpisodeMemory memory;
  memory.observations = entries(group, "observations");
  memory.kept =
      kNumber * (memory.observations + actions + rewards) + kFlag * (actions + mask + flags);
  // Whatever is not kept as numbers is read as numbers first.
  memory.passing = kNumber * std::max({rewards, flags, mask});
  return memory;
}

RawEpisode read_episode(const Group& group) {
  RawEpisode episode;
  episode.where = group.where();
  read_observations(group, episode);
  read_actions(group, episode);
  read_mask(group, episode);
  check_known_actions(group, episode);
  read_rewards(group, episode);
  episode.rest.terminations = read_flags(group, "terminations", episode.steps());
  episode.rest.truncations = read_flags(group, "truncations", episode.steps());
  // A file that does not say how its episodes end must not be taken to say that they never do: they
  // were cut off.
  if (group.kind("terminations") == Kind::kNothing && group.kind("truncations") == Kind::kNothing)
    episode.rest.truncations.back() = 1;
  episode.rest.seed = group.integer_attribute("seed");
  return episode;
}

}  // namespace agail
