// What a user asks for when training, and the task that it means.
#pragma once

#include <string>
#include <vector>

#include "agail/train/trainer.h"

namespace agail {

// What --method may be.
const std::vector<std::string>& training_methods();
// The same with spaces between them, for help and error messages.
const std::string& training_method_names();

struct TaskRequest {
  std::string environment;
  std::string method;                    // of training_methods()
  std::string preset = "default";        // a name, or the path of a TOML file
  std::vector<std::string> assignments;  // key=value, for any setting
  std::int64_t timesteps = 0;            // 0: as the settings say
  std::int64_t lanes = 0;                // 0: as the settings say
  std::uint64_t seed = 0;
  int threads = 0;  // 0: this rank's share of the machine's or container's cores
};

// The task without demonstrations. InputError for an unknown environment, method or setting, and
// for what check_settings() finds.
TrainingTask make_training_task(const TaskRequest& request);

}  // namespace agail
