// The one set of demonstrations of an environment: of the chosen expert, masked once a ratio.
#pragma once

#include <filesystem>
#include <string>

#include "agail/reproduce/experiment.h"
#include "agail/reproduce/record.h"

namespace agail {

// Where a run of this ratio finds its demonstrations in the folder of its environment's.
std::filesystem::path demonstrations_file(const std::filesystem::path& folder, double missing);

// The candidate whose worst episode is best; among equals the better mean, then the first. Not
// empty.
const ExpertRecord& choose_expert(const std::vector<ExpertRecord>& candidates);

// Reads the candidates' records and policies, records `choice` of the chosen one's episodes, writes
// a file for each ratio of the table (and one without actions) into `folder`, then `record`.
struct DemonstrationPlan {
  std::string environment;
  DemonstrationChoice choice;
  std::vector<std::filesystem::path> candidate_records, candidate_runs;
  std::filesystem::path folder, record;
};
void make_demonstrations(const DemonstrationPlan& plan);

}  // namespace agail
