// Ids to environments.
#include "agail/base/error.h"
#include "agail/base/nearest.h"
#include "agail/env/cartpole.h"
#include "agail/env/environment.h"
#include "agail/env/locomotion.h"
#include "agail/env/locomotion_task.h"

namespace agail {
namespace {

constexpr const char* kCartPoleIds[] = {"CartPole-v0", "CartPole-v1"};
constexpr int kCartPoleSteps[] = {200, 500};

[[noreturn]] void refuse(const std::string& id) {
  const std::vector<std::string> ids = environment_ids();
  throw InputError("no environment '" + id + "'; did you mean '" + nearest(id, ids) +
                   "'? `agail envs` lists them");
}

}  // namespace

std::vector<std::string> environment_ids() {
  std::vector<std::string> ids(std::begin(kCartPoleIds), std::end(kCartPoleIds));
  for (const LocomotionTask& task : locomotion_tasks()) ids.push_back(task.id);
  return ids;
}

std::unique_ptr<Environment> make_environment(const std::string& id) {
  for (std::size_t i = 0; i < std::size(kCartPoleIds); ++i)
    if (id == kCartPoleIds[i]) return std::make_unique<CartPole>(id, kCartPoleSteps[i]);
  for (const LocomotionTask& task : locomotion_tasks())
    if (id == task.id) return make_locomotion(task);
  refuse(id);
}

EnvironmentSpec environment_spec(const std::string& id) {
  for (std::size_t i = 0; i < std::size(kCartPoleIds); ++i)
    if (id == kCartPoleIds[i]) return CartPole::make_spec(id, kCartPoleSteps[i]);
  for (const LocomotionTask& task : locomotion_tasks())
    if (id == task.id) return locomotion_spec(task);
  refuse(id);
}

}  // namespace agail
