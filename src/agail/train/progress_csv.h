// progress.csv: one row an update, columns fixed for the whole run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace agail {

class ProgressCsv {
 public:
  // Starts the file, or goes on behind the rows that are there. InputError if it has other columns;
  // SystemError if it cannot be written, here and below.
  ProgressCsv(std::filesystem::path path, std::vector<std::string> columns);

  // One value a column, in the shortest form that reads back as the same double; NaN is an empty
  // cell. The row is with the operating system when this returns.
  void row(std::span<const double> values);

  // Drops the rows whose `column` is larger than `value`, and a last row that was cut short: after
  // a crash the file may be ahead of the checkpoint that the run goes on from.
  void truncate_after(std::string_view column, double value);

 private:
  void open();
  void put(const std::string& line);

  std::filesystem::path path_;
  std::vector<std::string> columns_;
  std::ofstream file_;
};

}  // namespace agail
