#include "agail/reproduce/table.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <sstream>
#include <tuple>

#include "agail/base/atomic_file.h"
#include "agail/reproduce/statistics.h"

namespace agail {

namespace {

namespace fs = std::filesystem;

constexpr double kReached = 0.95;
constexpr std::uint64_t kBootstrapSeed = 0;

// environment,observations,actions,interactions,method,missing,mean,standard_error
std::optional<MeanAndError> paper_value(const Cell& cell) {
  std::string method = cell.method;
  std::transform(method.begin(), method.end(), method.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  if (method == "STATE-GAIL") method = "state-GAIL";
  std::istringstream lines{std::string(paper_files().front().text)};
  std::string line;
  std::getline(lines, line);  // the header
  while (std::getline(lines, line)) {
    std::vector<std::string> fields;
    std::istringstream row(line);
    for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
    if (fields.size() != 8 || fields[0] != table_environment(cell.environment).paper_name ||
        fields[4] != method)
      continue;
    if (cell.missing && std::stod(fields[5]) != *cell.missing) continue;
    return MeanAndError{std::stod(fields[6]), std::stod(fields[7])};
  }
  return std::nullopt;
}

double steps_to(const RunRecord& run, double bar) {
  for (const auto& [steps, value] : run.evaluations)
    if (value >= bar) return steps;
  return std::numeric_limits<double>::infinity();
}

void add_training(CellSummary& summary, const std::vector<RunRecord>& runs) {
  std::vector<TrainingCurve> curves;
  std::vector<double> late;
  for (const RunRecord& run : runs) {
    curves.push_back(run.training);
    if (run.training.late_return) late.push_back(*run.training.late_return);
  }
  if (const auto points = last_points(curves))
    summary.training = {mean_of(*points), population_standard_error_of(*points)};
  if (late.size() == runs.size()) summary.late = {mean_of(late), standard_error_of(late)};
}

CellSummary summarise_cell(const Cell& cell, const std::vector<RunRecord>& runs,
                           std::optional<double> expert) {
  CellSummary summary;
  summary.cell = cell;
  summary.seeds = runs.size();
  summary.paper = paper_value(cell);
  add_training(summary, runs);
  for (const RunRecord& run : runs) summary.deterministic.push_back(run.evaluation.mean_return);
  summary.iqm = interquartile_mean(summary.deterministic);
  std::tie(summary.iqm_low, summary.iqm_high) =
      interquartile_mean_interval({summary.deterministic}, kBootstrapSeed);
  summary.expert_return = expert;
  if (!expert) return summary;
  std::vector<double> steps;
  for (const RunRecord& run : runs) steps.push_back(steps_to(run, kReached * *expert));
  std::sort(steps.begin(), steps.end());
  summary.seeds_at_95 = static_cast<std::size_t>(
      std::count_if(steps.begin(), steps.end(), [](double s) { return std::isfinite(s); }));
  summary.seeds_to_95 = steps;
  if (const double median = steps[(steps.size() - 1) / 2]; std::isfinite(median))
    summary.steps_to_95 = median;
  return summary;
}

std::vector<fs::path> json_files(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::is_directory(folder))
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
      if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

double CellSummary::mean() const { return mean_of(deterministic); }

double CellSummary::worst() const {
  return *std::min_element(deterministic.begin(), deterministic.end());
}

std::optional<double> CellSummary::share_of_expert() const {
  if (!expert_return || *expert_return == 0) return std::nullopt;
  return mean() / *expert_return;
}

TableData read_records(const fs::path& out) {
  TableData data;
  for (const fs::path& file : json_files(out / "records"))
    data.runs.push_back(read_run_record(file));
  const std::vector<Cell> order = table_cells();
  const auto place = [&](const RunRecord& r) {
    return std::pair(std::find(order.begin(), order.end(), r.run.cell) - order.begin(), r.run.seed);
  };
  std::stable_sort(data.runs.begin(), data.runs.end(),
                   [&](const RunRecord& a, const RunRecord& b) { return place(a) < place(b); });
  for (const fs::path& file : json_files(out / "records" / "demonstrations"))
    data.demonstrations.push_back(read_demonstrations_record(file));
  return data;
}

std::vector<CellSummary> summarise(const TableData& data) {
  std::vector<CellSummary> cells;
  for (const Cell& cell : table_cells()) {
    std::vector<RunRecord> runs;
    for (const RunRecord& run : data.runs)
      if (run.run.cell == cell) runs.push_back(run);
    std::optional<double> expert;
    for (const DemonstrationsRecord& demos : data.demonstrations)
      if (demos.expert.environment == cell.environment)
        expert = demos.expert.evaluation.mean_return;
    if (!runs.empty()) cells.push_back(summarise_cell(cell, runs, expert));
  }
  return cells;
}

std::size_t write_tables(const fs::path& out) {
  const TableData data = read_records(out);
  const std::vector<CellSummary> cells = summarise(data);
  write_file_atomically(out / "table.csv", table_csv(cells));
  write_file_atomically(out / "table.md", table_markdown(data, cells));
  return data.runs.size();
}

}  // namespace agail
