#include "agail/train/task_request.h"

#include <algorithm>

#include "agail/base/error.h"
#include "agail/base/nearest.h"
#include "agail/base/thread_pool.h"
#include "agail/comm/launch.h"
#include "agail/config/resolve.h"

namespace agail {

const std::vector<std::string>& training_methods() {
  static const std::vector<std::string> methods = {"trpo",  "gail", "state-gail",
                                                   "agail", "bc",   "bco"};
  return methods;
}

const std::string& training_method_names() {
  static const std::string names = [] {
    std::string text;
    for (const std::string& method : training_methods()) text += (text.empty() ? "" : " ") + method;
    return text;
  }();
  return names;
}

TrainingTask make_training_task(const TaskRequest& request) {
  const std::vector<std::string>& methods = training_methods();
  if (std::find(methods.begin(), methods.end(), request.method) == methods.end())
    throw InputError("--method " + request.method + ": no such method; did you mean '" +
                     nearest(request.method, methods) + "'? (" + training_method_names() + ")");
  environment_spec(request.environment);  // an unknown id is told before anything else
  SettingsSource source{request.preset, request.environment, request.assignments};
  if (request.timesteps > 0)
    source.assignments.push_back("run.timesteps=" + std::to_string(request.timesteps));
  if (request.lanes > 0) source.assignments.push_back("run.lanes=" + std::to_string(request.lanes));
  TrainingTask task;
  task.environment = request.environment;
  task.method = request.method;
  task.settings = resolve_settings(source);
  check_settings(task.settings, task.environment, task.method);
  task.settings_toml = to_toml(task.settings);
  task.seed = request.seed;
  task.threads = request.threads > 0 ? request.threads
                                     : std::max(1, default_threads() / ranks_on_this_machine());
  return task;
}

}  // namespace agail
