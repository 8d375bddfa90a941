#include "agail/policy.h"

#include <stdexcept>

#include "agail/train/saved_policy.h"

namespace agail {

struct Policy::Implementation {
  SavedPolicy saved;
};

struct Policy::Workspace::State {
  SavedPolicy::Workspace saved;
};

Policy::Policy(std::shared_ptr<const Implementation> implementation)
    : implementation_(std::move(implementation)) {}

Policy Policy::load(const std::string& path) {
  return Policy(
      std::make_shared<Implementation>(Implementation{SavedPolicy::load(policy_file(path))}));
}

Policy::Workspace::Workspace(const Policy& policy)
    : state_(new State{policy.implementation_->saved.make_workspace()}) {}
Policy::Workspace::~Workspace() = default;
Policy::Workspace::Workspace(Workspace&&) noexcept = default;
Policy::Workspace& Policy::Workspace::operator=(Workspace&&) noexcept = default;

void Policy::act(std::span<const double> observation, Workspace& workspace,
                 std::span<float> action) const {
  if (observation.size() != observation_size() || action.size() != action_size())
    throw std::invalid_argument("this policy takes " + std::to_string(observation_size()) +
                                " observations and gives " + std::to_string(action_size()) +
                                " numbers, not " + std::to_string(observation.size()) + " and " +
                                std::to_string(action.size()));
  implementation_->saved.act(observation, nullptr, workspace.state_->saved, action.data());
}

std::vector<float> Policy::act(std::span<const double> observation) const {
  Workspace workspace(*this);
  std::vector<float> action(action_size());
  act(observation, workspace, action);
  return action;
}

std::size_t Policy::observation_size() const {
  return static_cast<std::size_t>(implementation_->saved.observation_dim());
}
std::size_t Policy::action_size() const {
  return static_cast<std::size_t>(implementation_->saved.action().dim);
}
bool Policy::discrete() const { return implementation_->saved.action().discrete; }
int Policy::actions() const { return implementation_->saved.action().n; }
const std::vector<float>& Policy::action_low() const { return implementation_->saved.action().low; }
const std::vector<float>& Policy::action_high() const {
  return implementation_->saved.action().high;
}
const std::string& Policy::environment() const { return implementation_->saved.info().environment; }

}  // namespace agail
