#include "agail/train/csv_log.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>
#include <utility>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

std::string cell(double value) {
  if (std::isnan(value)) return "";
  std::array<char, 32> text;
  // Counts as 1000000 rather than the equally exact and shorter 1e+06.
  const bool count = std::abs(value) < 1e15 && value == std::floor(value);
  const auto end =
      count ? std::to_chars(text.begin(), text.end(), static_cast<std::int64_t>(value)).ptr
            : std::to_chars(text.begin(), text.end(), value).ptr;
  return std::string(text.begin(), end);
}

std::string joined(std::span<const std::string> cells) {
  std::string line;
  for (const std::string& text : cells) line += (&text == cells.data() ? "" : ",") + text;
  return line + "\n";
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t comma = line.find(',');
    cells.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

std::string read_text(const fs::path& path) {
  const std::vector<std::uint8_t> bytes = read_file(path);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

CsvLog::CsvLog(fs::path path, std::vector<std::string> columns)
    : path_(std::move(path)), columns_(std::move(columns)) {
  for (const std::string& column : columns_)
    AGAIL_CHECK(column.find_first_of(",\"\n") == std::string::npos);
  const std::string header = joined(columns_);
  const std::string text = fs::exists(path_) ? read_text(path_) : "";
  if (text.find('\n') == std::string::npos && header.starts_with(text))
    write_file_atomically(path_, header);  // new, or its header was cut short
  else if (!text.starts_with(header))
    throw InputError(path_.string() +
                     ": its columns are not those of this run; give --out another folder");
  open();
}

void CsvLog::open() {
  file_.open(path_, std::ios::binary | std::ios::app);
  if (!file_) throw SystemError("cannot write " + path_.string());
}

void CsvLog::row(std::span<const double> values) {
  AGAIL_CHECK(values.size() == columns_.size());
  rows(values);
}

void CsvLog::rows(std::span<const double> values) {
  AGAIL_CHECK(values.size() % columns_.size() == 0);
  std::string text;
  std::vector<std::string> cells;
  for (const double value : values) {
    cells.push_back(cell(value));
    if (cells.size() < columns_.size()) continue;
    text += joined(cells);
    cells.clear();
  }
  if (!text.empty()) put(text);
}

void CsvLog::put(const std::string& text) {
  file_ << text << std::flush;
  if (!file_) throw SystemError("cannot write " + path_.string() + "; is the disk full?");
}

void CsvLog::sync() { sync_file(path_); }

void CsvLog::truncate_after(std::string_view column, double value) {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  AGAIL_CHECK(found != columns_.end());
  const auto index = static_cast<std::size_t>(found - columns_.begin());
  file_.close();

  const std::string text = read_text(path_);
  std::string kept = joined(columns_);
  std::size_t number = 2;  // of the line, for messages
  for (std::size_t begin = kept.size(), end = 0;
       (end = text.find('\n', begin)) != std::string::npos; begin = end + 1, ++number) {
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    const std::vector<std::string_view> cells = split(line);
    double at = 0;
    if (cells.size() != columns_.size() ||
        std::from_chars(cells[index].data(), cells[index].data() + cells[index].size(), at).ec !=
            std::errc())
      throw InputError(path_.string() + ":" + std::to_string(number) +
                       ": not a row of this file's columns; mend or remove the line");
    if (at <= value) kept += std::string(line) + "\n";
  }
  if (kept != text) write_file_atomically(path_, kept);
  open();
}

std::vector<std::pair<double, double>> read_columns(const fs::path& path, std::string_view first,
                                                    std::string_view second) {
  const std::string text = read_text(path);
  std::string_view rest = text;
  const auto next_line = [&] {
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) return std::vector<std::string_view>();
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    return split(line);
  };
  const std::vector<std::string_view> names = next_line();
  const auto index = [&](std::string_view name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end())
      throw InputError(path.string() + ": no column '" + std::string(name) +
                       "'; give a run of this version");
    return static_cast<std::size_t>(found - names.begin());
  };
  const std::size_t a = index(first), b = index(second);
  const auto number = [](std::string_view digits) {
    double value = std::numeric_limits<double>::quiet_NaN();
    std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return value;
  };
  std::vector<std::pair<double, double>> rows;
  for (auto cells = next_line(); cells.size() == names.size(); cells = next_line())
    rows.emplace_back(number(cells[a]), number(cells[b]));
  return rows;
}

}  // namespace agail
