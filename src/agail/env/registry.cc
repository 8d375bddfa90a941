// Ids to environments.
#include <utility>

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

thread_local EnvironmentSource* current_source = nullptr;

[[noreturn]] void refuse(const std::string& id) {
  const std::vector<std::string> ids = environment_ids();
  throw InputError("no environment '" + id + "'; did you mean '" + nearest(id, ids) +
                   "'? `agail envs` lists them; Gymnasium's other environments need agail's "
                   "Python package");
}

}  // namespace

std::vector<std::string> environment_ids() {
  std::vector<std::string> ids(std::begin(kCartPoleIds), std::end(kCartPoleIds));
  for (const LocomotionTask& task : locomotion_tasks()) ids.push_back(task.id);
  return ids;
}

EnvironmentScope::EnvironmentScope(EnvironmentSource& source)
    : previous_(std::exchange(current_source, &source)) {}

EnvironmentScope::~EnvironmentScope() { current_source = previous_; }

std::unique_ptr<Environment> make_environment(const std::string& id) {
  if (current_source != nullptr)
    if (auto environment = current_source->make(id)) return environment;
  for (std::size_t i = 0; i < std::size(kCartPoleIds); ++i)
    if (id == kCartPoleIds[i]) return std::make_unique<CartPole>(id, kCartPoleSteps[i]);
  for (const LocomotionTask& task : locomotion_tasks())
    if (id == task.id) return make_locomotion(task);
  refuse(id);
}

std::optional<EnvironmentSpec> find_environment_spec(const std::string& id) {
  if (current_source != nullptr)
    if (auto spec = current_source->spec(id)) return spec;
  for (std::size_t i = 0; i < std::size(kCartPoleIds); ++i)
    if (id == kCartPoleIds[i]) return CartPole::make_spec(id, kCartPoleSteps[i]);
  for (const LocomotionTask& task : locomotion_tasks())
    if (id == task.id) return locomotion_spec(task);
  return std::nullopt;
}

EnvironmentSpec environment_spec(const std::string& id) {
  if (auto spec = find_environment_spec(id)) return *spec;
  refuse(id);
}

}  // namespace agail
