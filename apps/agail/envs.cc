// `agail envs`: the built-in environments.
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "agail/env/environment.h"
#include "commands.h"

namespace agail {
namespace {

nlohmann::ordered_json describe(const EnvironmentSpec& spec) {
  return {{"environment", spec.id},
          {"observation_size", spec.observation_dim},
          {"action_space", spec.action.discrete ? "Discrete" : "Box"},
          {"action_size", spec.action.discrete ? spec.action.n : spec.action.dim},
          {"step_limit", spec.max_episode_steps}};
}

void print_json() {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const std::string& id : environment_ids()) list.push_back(describe(environment_spec(id)));
  std::printf("%s\n", list.dump(2).c_str());
}

void print_table() {
  std::printf("%-16s %12s  %-12s %10s\n", "environment", "observation", "action", "step limit");
  for (const std::string& id : environment_ids()) {
    const EnvironmentSpec spec = environment_spec(id);
    const std::string action = spec.action.discrete
                                   ? "Discrete(" + std::to_string(spec.action.n) + ")"
                                   : "Box(" + std::to_string(spec.action.dim) + ")";
    std::printf("%-16s %12d  %-12s %10d\n", id.c_str(), spec.observation_dim, action.c_str(),
                spec.max_episode_steps);
  }
}

}  // namespace

void add_envs(CLI::App& app) {
  CLI::App* command = app.add_subcommand("envs", "List the built-in environments");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print JSON");
  command->callback([json] { *json ? print_json() : print_table(); });
}

}  // namespace agail
