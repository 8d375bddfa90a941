#include "agail/demos/gymnasium_spec.h"

#include <regex>

namespace agail {
namespace {

struct Entry {
  const char* id;
  const char* entry_point;
  double reward_threshold;  // 0: none
  int max_episode_steps;
};

constexpr Entry kRegistry[] = {
    {"CartPole-v0", "classic_control.cartpole:CartPoleEnv", 195, 200},
    {"CartPole-v1", "classic_control.cartpole:CartPoleEnv", 475, 500},
    {"Hopper-v4", "mujoco.hopper_v4:HopperEnv", 3800, 1000},
    {"Hopper-v5", "mujoco.hopper_v5:HopperEnv", 3800, 1000},
    {"Walker2d-v4", "mujoco.walker2d_v4:Walker2dEnv", 0, 1000},
    {"Walker2d-v5", "mujoco.walker2d_v5:Walker2dEnv", 0, 1000},
    {"Humanoid-v4", "mujoco.humanoid_v4:HumanoidEnv", 0, 1000},
    {"Humanoid-v5", "mujoco.humanoid_v5:HumanoidEnv", 0, 1000},
    {"HalfCheetah-v4", "mujoco.half_cheetah_v4:HalfCheetahEnv", 4800, 1000},
    {"HalfCheetah-v5", "mujoco.half_cheetah_v5:HalfCheetahEnv", 4800, 1000},
    {"Ant-v4", "mujoco.ant_v4:AntEnv", 6000, 1000},
    {"Ant-v5", "mujoco.ant_v5:AntEnv", 6000, 1000},
    {"Swimmer-v4", "mujoco.swimmer_v4:SwimmerEnv", 360, 1000},
    {"Swimmer-v5", "mujoco.swimmer_v5:SwimmerEnv", 360, 1000},
};

}  // namespace

nlohmann::ordered_json gymnasium_spec(const std::string& id) {
  nlohmann::ordered_json spec = {{"id", id},
                                 {"entry_point", nullptr},
                                 {"reward_threshold", nullptr},
                                 {"nondeterministic", false},
                                 {"max_episode_steps", nullptr},
                                 {"order_enforce", true},
                                 {"disable_env_checker", false},
                                 {"kwargs", nlohmann::ordered_json::object()},
                                 {"additional_wrappers", nlohmann::ordered_json::array()},
                                 {"vector_entry_point", nullptr}};
  for (const Entry& entry : kRegistry) {
    if (id != entry.id) continue;
    spec["entry_point"] = std::string("gymnasium.envs.") + entry.entry_point;
    if (entry.reward_threshold > 0) spec["reward_threshold"] = entry.reward_threshold;
    spec["max_episode_steps"] = entry.max_episode_steps;
    if (id.starts_with("CartPole"))
      spec["vector_entry_point"] = "gymnasium.envs.classic_control.cartpole:CartPoleVectorEnv";
  }
  return spec;
}

bool is_gymnasium_id(const std::string& id) {
  static const std::regex form(R"(([\w:-]+/)?[\w:.-]+)");
  return id.size() < 200 && std::regex_match(id, form);
}

}  // namespace agail
