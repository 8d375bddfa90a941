#include "agail/reproduce/experiment.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "agail/base/crc32c.h"
#include "agail/base/error.h"
#include "agail/base/nearest.h"
#include "agail/config/resolve.h"

namespace agail {

namespace {

std::string percent(double ratio) { return std::to_string(std::lround(100 * ratio)); }

Settings with_evaluations(Settings settings) {
  const std::int64_t updates =
      (settings.run.timesteps + settings.run.batch_steps - 1) / settings.run.batch_steps;
  settings.run.evaluate_every =
      std::max<std::int64_t>(1, (updates + kEvaluationsOfARun - 1) / kEvaluationsOfARun);
  return settings;
}

Settings resolved(const std::string& preset, const std::string& environment,
                  std::vector<std::string> assignments, std::int64_t timesteps) {
  if (timesteps > 0) assignments.push_back("run.timesteps=" + std::to_string(timesteps));
  return with_evaluations(resolve_settings({preset, environment, std::move(assignments)}));
}

std::string fingerprint(const Settings& settings) {
  const std::string text = to_toml(settings);
  return "crc32c:" + std::to_string(crc32c(std::vector<std::uint8_t>(text.begin(), text.end())));
}

template <class T>
bool wanted(const std::vector<T>& filter, const T& value) {
  return filter.empty() || std::find(filter.begin(), filter.end(), value) != filter.end();
}

void check_names(const std::vector<std::string>& given, const std::vector<std::string>& known,
                 const char* option) {
  for (const std::string& name : given)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw InputError(std::string(option) + " " + name + ": not in the table; did you mean '" +
                       nearest(name, known) + "'?");
}

void check(const GridFilter& filter) {
  std::vector<std::string> environments;
  for (const TableEnvironment& e : table_environments()) environments.push_back(e.id);
  check_names(filter.environments, environments, "--envs");
  check_names(filter.methods, {std::begin(kTableMethods), std::end(kTableMethods)}, "--methods");
  for (const double ratio : filter.missing)
    if (std::find(std::begin(kMissingRatios), std::end(kMissingRatios), ratio) ==
        std::end(kMissingRatios))
      throw InputError("--missing " + nlohmann::json(ratio).dump() +
                       ": not in the table; it has 0 0.25 0.5 0.75");
}

}  // namespace

const std::vector<TableEnvironment>& table_environments() {
  static const std::vector<TableEnvironment> table = {{"CartPole-v0", "CartPole", 10},
                                                      {"Hopper-v4", "Hopper", 60},
                                                      {"Walker2d-v4", "Walker2d", 80},
                                                      {"Humanoid-v4", "Humanoid", 250}};
  return table;
}

const TableEnvironment& table_environment(const std::string& id) {
  const auto& all = table_environments();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const TableEnvironment& e) { return e.id == id; });
  if (found == all.end()) throw InputError(id + " is no environment of the table");
  return *found;
}

std::string GridRun::id() const {
  return cell.environment + "-" + cell.method + (cell.missing ? "-" + percent(*cell.missing) : "") +
         "-" + std::to_string(seed);
}

std::string GridRun::title() const {
  return cell.environment + " " + cell.method +
         (cell.method == "agail" ? " " + percent(*cell.missing) + " %" : "") + " seed " +
         std::to_string(seed);
}

DemonstrationChoice Experiment::demonstrations() const {
  if (preset == "paper") return {.episodes = 300, .sampled = true};
  return {};
}

Settings Experiment::settings(const std::string& environment) const {
  return resolved(preset, environment, assignments, timesteps);
}

Settings Experiment::expert_settings(const std::string& environment) const {
  return resolved(kExpertPreset, environment, {}, timesteps);
}

std::string Experiment::description() const {
  nlohmann::ordered_json text = {{"experiment", "table1"},
                                 {"preset", preset},
                                 {"set", assignments},
                                 {"timesteps", timesteps},
                                 {"demonstrations",
                                  {{"episodes", demonstrations().episodes},
                                   {"actions", demonstrations().sampled ? "sampled" : "mean"}}}};
  for (const TableEnvironment& e : table_environments())
    text["settings"][e.id] = fingerprint(settings(e.id));
  return text.dump(2) + "\n";
}

std::string Experiment::expert_description() const {
  nlohmann::ordered_json text = {
      {"experts", "trpo"}, {"preset", kExpertPreset}, {"timesteps", timesteps}};
  for (const TableEnvironment& e : table_environments())
    text["settings"][e.id] = fingerprint(expert_settings(e.id));
  return text.dump(2) + "\n";
}

std::vector<Cell> table_cells(const GridFilter& filter) {
  check(filter);
  std::vector<Cell> cells;
  for (const TableEnvironment& e : table_environments())
    for (const std::string method : kTableMethods) {
      if (!wanted(filter.environments, e.id) || !wanted(filter.methods, method)) continue;
      if (method == "trpo") cells.push_back({e.id, method, {}});
      if (method == "gail") cells.push_back({e.id, method, 0.0});
      if (method == "state-gail") cells.push_back({e.id, method, 1.0});
      if (method == "agail")
        for (const double ratio : kMissingRatios)
          if (wanted(filter.missing, ratio)) cells.push_back({e.id, method, ratio});
    }
  return cells;
}

std::vector<GridRun> grid_runs(const GridFilter& filter) {
  std::vector<std::uint64_t> seeds = filter.seeds;
  if (seeds.empty()) seeds.assign(std::begin(kTableSeeds), std::end(kTableSeeds));
  std::sort(seeds.begin(), seeds.end());
  seeds.erase(std::unique(seeds.begin(), seeds.end()), seeds.end());
  std::vector<GridRun> runs;
  for (const Cell& cell : table_cells(filter))
    for (const std::uint64_t seed : seeds) runs.push_back({cell, seed});
  return runs;
}

}  // namespace agail
