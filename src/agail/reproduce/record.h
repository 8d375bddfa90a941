// What a finished run leaves: a few KiB from which tables and figures are computed. Nothing in it
// depends on time, machine or paths, so equal runs leave equal bytes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "agail/reproduce/experiment.h"
#include "agail/reproduce/training_curve.h"

namespace agail {

// Deterministic episodes of one policy.
struct FinalEvaluation {
  std::int64_t episodes = 0;
  double mean_return = 0, standard_error = 0, worst_return = 0, mean_length = 0;
};

struct RunRecord {
  GridRun run;
  std::string preset;
  std::int64_t timesteps = 0;  // made; the budget is the setting run.timesteps
  double budget = 0;
  TrainingCurve training;
  std::vector<std::pair<double, double>> evaluations;  // timesteps, deterministic return; at 0 of a
                                                       // cloned start
  FinalEvaluation evaluation;
};

// A candidate for the expert of an environment's demonstrations.
struct ExpertRecord {
  std::string environment;
  std::uint64_t seed = 0;
  FinalEvaluation evaluation;
};

// The expert that was chosen, and what it demonstrated.
struct DemonstrationsRecord {
  ExpertRecord expert;
  DemonstrationChoice choice;
  std::int64_t transitions = 0;
  double mean_return = 0;
};

// Evaluates the policy of a finished run (the best-evaluated for trpo, the last for others) and
// writes the record atomically.
void write_run_record(const std::filesystem::path& file, const std::filesystem::path& run_folder,
                      const GridRun& run, const Experiment& experiment);
void write_expert_record(const std::filesystem::path& file, const std::filesystem::path& run_folder,
                         const std::string& environment, std::uint64_t seed);

void write_demonstrations_record(const std::filesystem::path& file,
                                 const std::vector<ExpertRecord>& candidates,
                                 const DemonstrationsRecord& record);

// InputError (one line, with the path) for anything that is not such a file.
RunRecord read_run_record(const std::filesystem::path& file);
ExpertRecord read_expert_record(const std::filesystem::path& file);
DemonstrationsRecord read_demonstrations_record(const std::filesystem::path& file);

}  // namespace agail
