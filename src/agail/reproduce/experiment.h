// The experiment of the paper's Table 1 as data: what is run, and what was chosen where the paper
// is silent. The reasons are in docs/reproduce.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "agail/config/settings.h"

namespace agail {

struct TableEnvironment {
  std::string id;
  std::string paper_name;    // in results/paper/*.csv; the paper's MuJoCo environments were v2
  double step_microseconds;  // of training on one core, roughly: decides only the order of the runs
};
const std::vector<TableEnvironment>& table_environments();
const TableEnvironment& table_environment(const std::string& id);

// One entry of the table. `missing`: share of the demonstrated actions that are missing; none for
// trpo, which has no demonstrations.
struct Cell {
  std::string environment, method;
  std::optional<double> missing;
  bool operator==(const Cell&) const = default;
};

struct GridRun {
  Cell cell;
  std::uint64_t seed = 0;
  std::string id() const;     // of files: "Hopper-v4-agail-25-0"
  std::string title() const;  // for people: "Hopper-v4 agail 25 % seed 0"
};

inline constexpr const char* kTableMethods[] = {"trpo", "gail", "state-gail", "agail"};
inline constexpr double kMissingRatios[] = {0, 0.25, 0.5, 0.75};    // agail's columns
inline constexpr std::uint64_t kTableSeeds[] = {0, 1, 2, 3, 4, 5};  // tuning has those from 10 up

// Experts are TRPO runs in preset `default`. Of these seeds the one is taken whose worst of
// kEvaluationEpisodes is best: an expert that falls now and then demonstrates falling.
inline constexpr const char* kExpertPreset = "default";
inline constexpr std::uint64_t kExpertSeeds[] = {10, 11, 12};
inline constexpr std::uint64_t kRecordSeed = 0, kMaskSeed = 0;

// The last word on a policy: deterministic episodes that training has not seen.
inline constexpr std::int64_t kEvaluationEpisodes = 50;
inline constexpr std::uint64_t kEvaluationSeed = 1000;

// While training: about this many evaluations, of the preset's number of episodes.
inline constexpr std::int64_t kEvaluationsOfARun = 25;

struct DemonstrationChoice {
  std::int64_t episodes = 10;
  bool sampled = false;  // actions sampled from the expert's policy rather than its mode
};

struct Experiment {
  std::string preset = "default";        // as agail train has it
  std::vector<std::string> assignments;  // key=value, as --set
  std::int64_t timesteps = 0;            // 0: the environment's own

  DemonstrationChoice demonstrations() const;
  // Of a run, with the number of evaluations settled. InputError.
  Settings settings(const std::string& environment) const;
  // Of an expert, which only `timesteps` changes.
  Settings expert_settings(const std::string& environment) const;
  // What the folder of the experiment is for, as JSON: equal experiments give equal bytes.
  std::string description() const;
  std::string expert_description() const;
};

// What of the grid is asked for; an empty list is all of it.
struct GridFilter {
  std::vector<std::string> environments, methods;
  std::vector<double> missing;  // of agail
  std::vector<std::uint64_t> seeds;
};

// In the table's order: environments, then methods and ratios, then seeds. InputError if the filter
// names what the table does not have.
std::vector<Cell> table_cells(const GridFilter& filter = {});
std::vector<GridRun> grid_runs(const GridFilter& filter);

}  // namespace agail
