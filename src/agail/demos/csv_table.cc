#include "agail/demos/csv_table.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"

namespace agail {
namespace {

constexpr std::size_t kMostColumns = 100000;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\"";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t comma = line.find(',');
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

// NaN if the cell is empty; false if it is no number.
bool parse(std::string_view cell, double& value) {
  value = std::numeric_limits<double>::quiet_NaN();
  if (cell.empty()) return true;
  if (cell == "True" || cell == "true" || cell == "False" || cell == "false") {
    value = cell.front() == 'T' || cell.front() == 't' ? 1 : 0;
    return true;
  }
  if (cell.front() == '+') cell.remove_prefix(1);
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc{} && end == cell.data() + cell.size();
}

struct Columns {
  std::map<std::string, std::size_t, std::less<>> single;  // name -> position
  std::map<std::string, std::map<std::size_t, std::size_t>, std::less<>>
      indexed;  // prefix -> index -> position
};

Columns columns_of(const std::vector<std::string_view>& header, const std::string& where,
                   std::vector<std::string>& ignored) {
  Columns columns;
  for (std::size_t position = 0; position < header.size(); ++position) {
    const std::string_view name = header[position];
    bool used = false;
    for (const std::string_view prefix : {"obs_", "action_", "next_obs_"}) {
      if (!name.starts_with(prefix)) continue;
      std::size_t index = 0;
      const auto [end, error] =
          std::from_chars(name.data() + prefix.size(), name.data() + name.size(), index);
      if (error != std::errc{} || end != name.data() + name.size()) continue;
      if (!columns.indexed[std::string(prefix)].emplace(index, position).second)
        throw InputError(where + " has two columns " + std::string(name));
      used = true;
    }
    for (const std::string_view single :
         {"action", "reward", "terminated", "truncated", "episode"}) {
      if (name != single) continue;
      if (!columns.single.emplace(name, position).second)
        throw InputError(where + " has two columns " + std::string(name));
      used = true;
    }
    if (!used) ignored.emplace_back(name);
  }
  for (const auto& [prefix, positions] : columns.indexed)
    if (positions.rbegin()->first + 1 != positions.size())
      throw InputError(where + " lacks some of the columns " + prefix + "0 to " + prefix +
                       std::to_string(positions.rbegin()->first));
  return columns;
}

RowMatrix<double> pick(const RowMatrix<double>& all,
                       const std::map<std::size_t, std::size_t>& positions) {
  RowMatrix<double> picked(all.rows(), static_cast<Eigen::Index>(positions.size()));
  for (const auto& [index, position] : positions)
    picked.col(static_cast<Eigen::Index>(index)) = all.col(static_cast<Eigen::Index>(position));
  return picked;
}

std::vector<double> pick(const RowMatrix<double>& all, const Columns& columns, const char* name) {
  const auto found = columns.single.find(name);
  if (found == columns.single.end()) return {};
  const Eigen::VectorXd column = all.col(static_cast<Eigen::Index>(found->second));
  return {column.begin(), column.end()};
}

bool whole_numbers(const RowMatrix<double>& values) {
  return (values.array().isNaN() || values.array() == values.array().floor()).all();
}

}  // namespace

StepTable read_csv(const std::string& path, std::vector<std::string>& ignored) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const auto next_line = [&text] {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    return line;
  };
  const std::vector<std::string_view> header = cells_of(next_line());
  if (header.size() > kMostColumns)
    throw InputError(path + " has too many columns for a table of steps");
  const Columns columns = columns_of(header, path, ignored);
  if (!columns.indexed.contains("obs_"))
    throw InputError(path +
                     " has no columns obs_0, obs_1, ...; its first line must name the columns");
  if (columns.indexed.contains("action_") && columns.single.contains("action"))
    throw InputError(path + " has both action and action_0; keep one kind");

  // Columns that are ignored may hold anything.
  std::vector<bool> used(header.size(), false);
  for (const auto& [name, position] : columns.single) used[position] = true;
  for (const auto& [prefix, positions] : columns.indexed)
    for (const auto& [index, position] : positions) used[position] = true;
  std::vector<double> values;
  std::size_t row = 0;
  while (!text.empty()) {
    const std::string_view line = next_line();
    if (trimmed(line).empty()) continue;
    const std::vector<std::string_view> cells = cells_of(line);
    if (cells.size() != header.size())
      throw InputError(path + ": row " + std::to_string(row) + " has " +
                       std::to_string(cells.size()) + " cells, the header " +
                       std::to_string(header.size()));
    for (std::size_t i = 0; i < cells.size(); ++i) {
      values.push_back(0);
      if (used[i] && !parse(cells[i], values.back()))
        throw InputError(path + ": row " + std::to_string(row) + ", column " +
                         std::string(header[i]) + " is not a number");
    }
    ++row;
  }
  const RowMatrix<double> all = Eigen::Map<const RowMatrix<double>>(
      values.data(), static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(header.size()));
  StepTable table;
  table.where = path;
  table.observations = pick(all, columns.indexed.at("obs_"));
  if (columns.indexed.contains("next_obs_")) {
    table.next_observations = pick(all, columns.indexed.at("next_obs_"));
    if (table.next_observations->cols() != table.observations.cols())
      throw InputError(path + " has not as many columns next_obs_* as obs_*");
  }
  table.actions.resize(all.rows(), 0);
  if (columns.indexed.contains("action_")) table.actions = pick(all, columns.indexed.at("action_"));
  if (columns.single.contains("action")) {
    table.actions = all.col(static_cast<Eigen::Index>(columns.single.at("action")));
    table.discrete = whole_numbers(table.actions);
  }
  table.rewards = pick(all, columns, "reward");
  table.terminations = pick(all, columns, "terminated");
  table.truncations = pick(all, columns, "truncated");
  if (columns.single.contains("episode"))
    table.starts = split_at_changes(pick(all, columns, "episode"), path);
  return table;
}

}  // namespace agail
