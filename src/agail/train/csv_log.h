// progress.csv and episodes.csv: columns fixed for the whole run, rows added as it goes on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace agail {

class CsvLog {
 public:
  // Starts the file, or goes on behind the rows that are there. InputError if it has other columns;
  // SystemError if it cannot be written, here and below.
  CsvLog(std::filesystem::path path, std::vector<std::string> columns);

  // One value a column, in the shortest form that reads back as the same double; NaN is an empty
  // cell. The row is with the operating system when this returns.
  void row(std::span<const double> values);
  // Several at once: values of the first row, then of the second...
  void rows(std::span<const double> values);

  // Everything so far is on the disk, and outlasts a power cut, when this returns.
  void sync();

  // Drops the rows whose `column` is larger than `value`, and a last row that was cut short: after
  // a crash the file may be ahead of the checkpoint that the run goes on from.
  void truncate_after(std::string_view column, double value);

 private:
  void open();
  void put(const std::string& text);

  std::filesystem::path path_;
  std::vector<std::string> columns_;
  std::ofstream file_;
};

// Two columns of such a file, row by row; NaN for an empty cell. InputError if the file cannot be
// read or lacks a column.
std::vector<std::pair<double, double>> read_columns(const std::filesystem::path& path,
                                                    std::string_view first,
                                                    std::string_view second);

}  // namespace agail
