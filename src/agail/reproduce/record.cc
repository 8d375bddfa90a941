#include "agail/reproduce/record.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "agail/base/atomic_file.h"
#include "agail/config/resolve.h"
#include "agail/config/setting.h"
#include "agail/train/csv_log.h"
#include "agail/train/evaluation.h"

namespace agail {

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

ordered_json read_json(const fs::path& file) {
  const std::vector<std::uint8_t> bytes = read_file(file);
  ordered_json json = ordered_json::parse(bytes.begin(), bytes.end(), nullptr, false);
  if (!json.is_object())
    throw InputError(file.string() + ": not JSON; remove it and the run is made again");
  return json;
}

// One line a key: short, and what changed shows in a diff.
std::string lines(const ordered_json& object) {
  std::string text = "{";
  for (const auto& [key, value] : object.items())
    text += (text.size() > 1 ? ",\n " : "\n ") + ordered_json(key).dump() + ": " + value.dump();
  return text + "\n}\n";
}

// Settings that are not the starting values of src/agail/config/settings.h.
ordered_json changed_settings(const Settings& settings) {
  const Settings start;
  ordered_json result = ordered_json::object();
  for (const Setting& setting : settings_table())
    if (to_toml(setting.get(settings)) != to_toml(setting.get(start)))
      result[setting.name] = to_toml(setting.get(settings));
  return result;
}

FinalEvaluation evaluate_finally(const SavedPolicy& policy) {
  ThreadPool pool(1);
  const Evaluation result = evaluate(policy, kEvaluationEpisodes, kEvaluationSeed, false, pool);
  return {kEvaluationEpisodes, result.mean_return(), result.standard_error(),
          *std::min_element(result.returns.begin(), result.returns.end()), result.mean_length()};
}

ordered_json to_json(const FinalEvaluation& evaluation) {
  return {{"episodes", evaluation.episodes},         {"seed", kEvaluationSeed},
          {"mean_return", evaluation.mean_return},   {"standard_error", evaluation.standard_error},
          {"worst_return", evaluation.worst_return}, {"mean_length", evaluation.mean_length}};
}

FinalEvaluation final_evaluation(const ordered_json& json) {
  return {json.at("episodes"), json.at("mean_return"), json.at("standard_error"),
          json.at("worst_return"), json.at("mean_length")};
}

ExpertRecord expert_of(const ordered_json& json) {
  return {json.at("environment"), json.at("seed"), final_evaluation(json.at("final_evaluation"))};
}

// Pairs (timesteps, deterministic return) from the run's summary and progress.csv.
ordered_json evaluations(const fs::path& run_folder, const ordered_json& summary) {
  ordered_json result = ordered_json::array();
  if (summary.contains("cloned_evaluation"))
    result.push_back({0, summary["cloned_evaluation"]["mean_return"]});
  for (const auto& [timesteps, value] :
       read_columns(run_folder / "progress.csv", "time/total_timesteps", "eval/mean_reward"))
    if (!std::isnan(value)) result.push_back({std::lround(timesteps), value});
  return result;
}

ordered_json training(const TrainingCurve& curve) {
  ordered_json tail = ordered_json::array();
  for (const TrainingEpisode& episode : curve.tail)
    tail.push_back({std::lround(episode.end), episode.episode_return});
  return {
      {"episodes", curve.episodes},
      {"first_end", curve.first_end},
      {"last_end", curve.last_end},
      {"late_return", curve.late_return ? ordered_json(*curve.late_return) : ordered_json(nullptr)},
      {"curve", curve.curve},
      {"tail", tail}};
}

TrainingCurve training_of(const ordered_json& json) {
  TrainingCurve curve{json.at("episodes"), json.at("first_end"), json.at("last_end"), {}, {}, {}};
  if (!json.at("late_return").is_null()) curve.late_return = json.at("late_return").get<double>();
  for (const auto& value : json.at("curve"))
    curve.curve.push_back(value.is_null() ? NAN : value.get<double>());
  for (const auto& point : json.at("tail")) curve.tail.push_back({point.at(0), point.at(1)});
  return curve;
}

// Runs `read` and says which file it was if that fails.
template <class Read>
auto from_json(const fs::path& file, Read read) {
  try {
    return read(read_json(file));
  } catch (const nlohmann::json::exception&) {
    throw InputError(file.string() +
                     ": not a record of agail reproduce; remove it and the run is made again");
  }
}

}  // namespace

void write_run_record(const fs::path& file, const fs::path& run_folder, const GridRun& run,
                      const Experiment& experiment) {
  const ordered_json summary = read_json(run_folder / "summary.json");
  const Settings settings = experiment.settings(run.cell.environment);
  const auto budget = static_cast<double>(settings.run.timesteps);
  const EnvironmentSpec spec = environment_spec(run.cell.environment);
  const TrainingCurve curve = training_curve(read_training_episodes(run_folder), budget,
                                             static_cast<double>(spec.max_episode_steps));
  ordered_json record = {
      {"environment", run.cell.environment},
      {"method", run.cell.method},
      {"missing", run.cell.missing ? ordered_json(*run.cell.missing) : ordered_json(nullptr)},
      {"seed", run.seed},
      {"preset", experiment.preset},
      {"settings", changed_settings(settings)},
      {"budget", settings.run.timesteps},
      {"timesteps", summary.at("timesteps")}};
  if (summary.contains("demonstrations")) record["demonstrations"] = summary["demonstrations"];
  record["signature"] = SavedPolicy::load(run_folder / "policy.safetensors").signature();
  record["final_evaluation"] =
      to_json(evaluate_finally(SavedPolicy::load(policy_file(run_folder))));
  record["evaluations"] = evaluations(run_folder, summary);
  record["training"] = training(curve);
  write_file_atomically(file, lines(record));
}

void write_expert_record(const fs::path& file, const fs::path& run_folder,
                         const std::string& environment, std::uint64_t seed) {
  const ordered_json summary = read_json(run_folder / "summary.json");
  const SavedPolicy policy = SavedPolicy::load(policy_file(run_folder));
  write_file_atomically(file, lines({{"environment", environment},
                                     {"method", "trpo"},
                                     {"preset", kExpertPreset},
                                     {"seed", seed},
                                     {"timesteps", summary.at("timesteps")},
                                     {"signature", policy.signature()},
                                     {"final_evaluation", to_json(evaluate_finally(policy))},
                                     {"evaluations", evaluations(run_folder, summary)}}));
}

void write_demonstrations_record(const fs::path& file, const std::vector<ExpertRecord>& candidates,
                                 const DemonstrationsRecord& record) {
  ordered_json all = ordered_json::array();
  for (const ExpertRecord& candidate : candidates)
    all.push_back({{"seed", candidate.seed},
                   {"mean_return", candidate.evaluation.mean_return},
                   {"worst_return", candidate.evaluation.worst_return}});
  write_file_atomically(file, lines({{"environment", record.expert.environment},
                                     {"seed", record.expert.seed},
                                     {"final_evaluation", to_json(record.expert.evaluation)},
                                     {"candidates", all},
                                     {"demonstrations",
                                      {{"episodes", record.choice.episodes},
                                       {"actions", record.choice.sampled ? "sampled" : "mean"},
                                       {"transitions", record.transitions},
                                       {"mean_return", record.mean_return}}}}));
}

RunRecord read_run_record(const fs::path& file) {
  return from_json(file, [](const ordered_json& json) {
    RunRecord record;
    record.run = {{json.at("environment"), json.at("method"), {}}, json.at("seed")};
    if (!json.at("missing").is_null()) record.run.cell.missing = json.at("missing").get<double>();
    record.preset = json.at("preset").get<std::string>();
    record.timesteps = json.at("timesteps");
    record.budget = json.at("budget");
    record.training = training_of(json.at("training"));
    for (const auto& point : json.at("evaluations"))
      record.evaluations.emplace_back(point.at(0), point.at(1));
    record.evaluation = final_evaluation(json.at("final_evaluation"));
    return record;
  });
}

ExpertRecord read_expert_record(const fs::path& file) { return from_json(file, expert_of); }

DemonstrationsRecord read_demonstrations_record(const fs::path& file) {
  return from_json(file, [](const ordered_json& json) {
    const ordered_json& demos = json.at("demonstrations");
    return DemonstrationsRecord{expert_of(json),
                                {demos.at("episodes"), demos.at("actions") == "sampled"},
                                demos.at("transitions"),
                                demos.at("mean_return")};
  });
}

}  // namespace agail
