#include "agail/demos/step_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "agail/base/error.h"

namespace agail {
namespace {

bool flag(const std::vector<double>& flags, std::size_t row) {
  return !flags.empty() && flags[row] == 1;
}

std::string row_name(std::size_t row) { return "row " + std::to_string(row); }

void fits_float32(const StepTable& table, const RowMatrix<double>& values,
                  const std::string& what) {
  const Eigen::Index row = first_row_beyond_float32(values);
  if (row >= 0)
    throw InputError(table.where + ": " + what + " in " + row_name(static_cast<std::size_t>(row)) +
                     " is too large for float32; use other units");
}

void check_table(const StepTable& table) {
  const auto bad = [&](const RowMatrix<double>& values, const std::string& what) {
    for (Eigen::Index t = 0; t < values.rows(); ++t)
      if (!values.row(t).allFinite())
        throw InputError(table.where + ": " + what + " in " +
                         row_name(static_cast<std::size_t>(t)) +
                         " is empty, NaN or infinite; only actions may be missing");
    fits_float32(table, values, what);
  };
  if (table.observations.rows() == 0) throw InputError(table.where + " has no rows");
  bad(table.observations, "an observation");
  if (table.next_observations) bad(*table.next_observations, "a next observation");
  if (table.actions.array().isInf().any())
    throw InputError(table.where + " has infinite actions; leave a missing action empty (NaN)");
  fits_float32(table, table.actions, "an action");
  for (const auto* flags : {&table.terminations, &table.truncations})
    for (std::size_t row = 0; row < flags->size(); ++row)
      if ((*flags)[row] != 0 && (*flags)[row] != 1 && !std::isnan((*flags)[row]))
        throw InputError(table.where + ": the termination or truncation in " + row_name(row) +
                         " is neither 0 nor 1");
}

// A next observation must be the following row's observation, or the episodes' borders are wrong.
void check_continuity(const StepTable& table, std::size_t begin, std::size_t end) {
  for (std::size_t row = begin; row + 1 < end; ++row) {
    const auto t = static_cast<Eigen::Index>(row);
    const auto here = table.next_observations->row(t).array();
    const auto there = table.observations.row(t + 1).array();
    if (((here - there).abs() > 1e-5 * (1 + there.abs())).any())
      throw InputError(table.where + ": the next observation of " + row_name(row) +
                       " is not the observation of " + row_name(row + 1) +
                       "; mark where episodes begin (column episode, array episode_starts)");
  }
}

void fill_ends(const StepTable& table, std::size_t begin, std::size_t last_step, std::size_t end,
               DemoEpisode& episode) {
  const std::size_t steps = last_step + 1 - begin;
  episode.terminations.assign(steps, 0);
  episode.truncations.assign(steps, 0);
  for (std::size_t row = begin; row < last_step; ++row)
    if (flag(table.terminations, row) || flag(table.truncations, row))
      throw InputError(table.where + ": " + row_name(row) +
                       " ends an episode that goes on after it; mark where " +
                       "episodes begin (column episode, array episode_starts)");
  for (std::size_t row = last_step; row < end; ++row) {
    episode.terminations.back() |= flag(table.terminations, row);
    episode.truncations.back() |= flag(table.truncations, row);
  }
  if (episode.terminations.back() == 0) episode.truncations.back() = 1;
}

DemoEpisode episode_from(const StepTable& table, std::size_t begin, std::size_t end,
                         const ActionSpace& space) {
  const bool steps_only = table.next_observations.has_value();
  const std::size_t steps = end - begin - (steps_only ? 0 : 1);
  if (steps == 0)
    throw InputError(table.where + ": the episode at " + row_name(begin) +
                     " has a single row; it needs one more for the state after its action");
  const auto first = static_cast<Eigen::Index>(begin);
  const auto count = static_cast<Eigen::Index>(steps);
  DemoEpisode episode;
  episode.observations.resize(count + 1, table.observations.cols());
  episode.observations.topRows(count) = table.observations.middleRows(first, count);
  if (steps_only) {
    check_continuity(table, begin, end);
    episode.observations.row(count) = table.next_observations->row(first + count - 1);
  } else {
    episode.observations.row(count) = table.observations.row(first + count);
  }
  const double missing = space.discrete ? 0.0 : std::numeric_limits<double>::quiet_NaN();
  episode.actions.setConstant(count, space.dim, missing);
  episode.available.setZero(count, space.dim);
  for (Eigen::Index t = 0; t < count && table.actions.cols() > 0; ++t)
    for (Eigen::Index k = 0; k < space.dim; ++k) {
      const double action = table.actions(first + t, k);
      if (std::isnan(action)) continue;
      if (space.discrete && (action < 0 || action >= space.n || std::floor(action) != action))
        throw InputError(table.where + ": the action in " +
                         row_name(begin + static_cast<std::size_t>(t)) + " is none of 0 to " +
                         std::to_string(space.n - 1));
      episode.actions(t, k) = action;
      episode.available(t, k) = 1;
    }
  if (!table.rewards.empty()) {
    episode.rewards.assign(table.rewards.begin() + first, table.rewards.begin() + first + count);
    for (std::size_t t = 0; t < steps; ++t)
      if (!std::isfinite(episode.rewards[t]))
        throw InputError(
            table.where + ": the reward in " + row_name(begin + t) +
            " is empty, NaN or infinite; leave rewards out altogether if they are unknown");
  }
  fill_ends(table, begin, begin + steps - 1, end, episode);
  return episode;
}

ActionSpace space_of(const StepTable& table, const std::optional<ActionSpace>& known) {
  const auto columns = static_cast<int>(table.actions.cols());
  if (known) {
    if (columns != 0 && columns != known->dim)
      throw InputError(table.where + " has " + std::to_string(columns) +
                       " action columns, the environment " + std::to_string(known->dim));
    return *known;
  }
  ActionSpace space;
  space.dim = columns;
  space.discrete = table.discrete && columns == 1;
  if (space.discrete) {
    double largest = 0;
    for (Eigen::Index t = 0; t < table.actions.rows(); ++t)
      if (table.actions(t, 0) > largest) largest = table.actions(t, 0);
    if (largest >= 65536) throw InputError(table.where + " has a discrete action above 65535");
    space.n = static_cast<int>(largest) + 1;
  } else {
    space.low.assign(static_cast<std::size_t>(columns), -std::numeric_limits<float>::infinity());
    space.high.assign(static_cast<std::size_t>(columns), std::numeric_limits<float>::infinity());
  }
  return space;
}

}  // namespace

std::vector<std::size_t> split_at_flags(const StepTable& table) {
  const auto rows = static_cast<std::size_t>(table.observations.rows());
  std::vector<std::size_t> starts = {0};
  for (std::size_t row = 0; row + 1 < rows; ++row)
    if (flag(table.terminations, row) || flag(table.truncations, row)) starts.push_back(row + 1);
  return starts;
}

std::vector<std::size_t> split_at_changes(const std::vector<double>& ids,
                                          const std::string& where) {
  std::vector<std::size_t> starts;
  std::set<double> seen;
  for (std::size_t row = 0; row < ids.size(); ++row) {
    if (!std::isfinite(ids[row]))
      throw InputError(where + ": the episode in " + row_name(row) + " is not a number");
    if (std::abs(ids[row]) >= 0x1p53)  // from there two ids may be one double
      throw InputError(where + ": the episode in " + row_name(row) +
                       " has a number of 2^53 or more; use smaller ones, for example 0, 1, 2");
    if (row > 0 && ids[row] == ids[row - 1]) continue;
    if (!seen.insert(ids[row]).second)
      throw InputError(where + ": " + row_name(row) +
                       " goes back to an earlier episode; sort the rows by episode");
    starts.push_back(row);
  }
  return starts;
}

Demonstrations demonstrations_from(const StepTable& table, const std::string& environment,
                                   const std::optional<ActionSpace>& known) {
  check_table(table);
  Demonstrations demonstrations;
  demonstrations.environment = environment;
  demonstrations.observation_dim = static_cast<int>(table.observations.cols());
  demonstrations.observations_are_float32 = table.observations_are_float32;
  demonstrations.action = space_of(table, known);
  const auto rows = static_cast<std::size_t>(table.observations.rows());
  const std::vector<std::size_t> starts =
      table.starts.empty() ? split_at_flags(table) : table.starts;
  if (starts.front() != 0)
    throw InputError(table.where + ": the first episode must begin with row 0");
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const std::size_t end = i + 1 < starts.size() ? starts[i + 1] : rows;
    if (end <= starts[i] || end > rows)
      throw InputError(table.where +
                       ": the beginnings of episodes must increase and lie within the " +
                       std::to_string(rows) + " rows");
    demonstrations.episodes.push_back(episode_from(table, starts[i], end, demonstrations.action));
  }
  return demonstrations;
}

}  // namespace agail
