// Table 1 from records: what the paper has, what these runs have, side by side.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "agail/base/embedded_file.h"
#include "agail/reproduce/record.h"

namespace agail {

struct MeanAndError {
  double mean = 0, standard_error = 0;
};

// What is said of one cell; parts that the records do not give are absent.
struct CellSummary {
  Cell cell;
  std::size_t seeds = 0;
  std::optional<MeanAndError> paper;     // the paper's Table 1 (MuJoCo environments v2)
  std::optional<MeanAndError> training;  // ours, by the paper's statistic
  std::optional<MeanAndError> late;      // training returns of the last tenth of the budget
  std::vector<double> deterministic;     // mean of the final evaluation, one a seed
  double iqm = 0, iqm_low = 0, iqm_high = 0;
  std::optional<double> expert_return;  // deterministic
  // Interactions at the first evaluation at 95 % of the expert's return; the median over the seeds,
  // where one that never gets there counts as infinitely late. None if the median is that.
  std::optional<double> steps_to_95;
  std::vector<double> seeds_to_95;  // one a seed, ascending; infinity: never
  std::size_t seeds_at_95 = 0;

  double mean() const;
  double worst() const;
  std::optional<double> share_of_expert() const;
};

struct TableData {
  std::vector<RunRecord> runs;
  std::vector<DemonstrationsRecord> demonstrations;
};

// All records of a folder, in the order of the table, then of the seeds.
TableData read_records(const std::filesystem::path& out);

// Cells with at least one run, in the order of the table.
std::vector<CellSummary> summarise(const TableData& data);

// Columns: environment, method, missing, paper_mean, paper_standard_error (the paper's Table 1),
// mean, standard_error (ours, the same statistic), deterministic_mean, iqm, iqm_low, iqm_high,
// worst_seed, share_of_expert, steps_to_95. An empty field: there is none.
std::string table_csv(std::span<const CellSummary> cells);
std::string table_markdown(const TableData& data, std::span<const CellSummary> cells);

// table.csv and table.md from records/. Returns the number of runs in them.
std::size_t write_tables(const std::filesystem::path& out);

// results/paper/table1.csv, compiled in.
std::span<const EmbeddedFile> paper_files();

}  // namespace agail
