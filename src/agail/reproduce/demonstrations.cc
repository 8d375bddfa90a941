#include "agail/reproduce/demonstrations.h"

#include <algorithm>
#include <cmath>

#include "agail/base/atomic_file.h"
#include "agail/demos/mask.h"
#include "agail/demos/minari_writer.h"
#include "agail/train/evaluation.h"

namespace agail {

namespace {

namespace fs = std::filesystem;

void write_masked(const Demonstrations& whole, double missing, const fs::path& file) {
  Demonstrations demos = whole;
  if (missing > 0)
    remove_actions(
        demos,
        {.pattern = MaskPattern::kStep, .ratio = missing, .seed = kMaskSeed, .dimension = {}});
  write_demonstrations(demos, file.string());
}

}  // namespace

fs::path demonstrations_file(const fs::path& folder, double missing) {
  return folder / ("missing-" + std::to_string(std::lround(100 * missing)) + ".hdf5");
}

const ExpertRecord& choose_expert(const std::vector<ExpertRecord>& candidates) {
  return *std::max_element(candidates.begin(), candidates.end(),
                           [](const ExpertRecord& a, const ExpertRecord& b) {
                             return std::pair(a.evaluation.worst_return, a.evaluation.mean_return) <
                                    std::pair(b.evaluation.worst_return, b.evaluation.mean_return);
                           });
}

void make_demonstrations(const DemonstrationPlan& plan) {
  std::vector<ExpertRecord> candidates;
  for (const fs::path& file : plan.candidate_records)
    candidates.push_back(read_expert_record(file));
  const ExpertRecord& expert = choose_expert(candidates);
  const auto index = static_cast<std::size_t>(&expert - candidates.data());
  const SavedPolicy policy = SavedPolicy::load(policy_file(plan.candidate_runs[index]));
  ThreadPool pool(1);
  const Demonstrations whole =
      record(policy, plan.choice.episodes, kRecordSeed, plan.choice.sampled, pool);
  create_output_folder(plan.folder);
  for (const double missing : kMissingRatios)
    write_masked(whole, missing, demonstrations_file(plan.folder, missing));
  write_masked(whole, 1, demonstrations_file(plan.folder, 1));

  write_demonstrations_record(plan.record, candidates,
                              {expert, plan.choice, whole.transitions(), whole.mean_return()});
}

}  // namespace agail
