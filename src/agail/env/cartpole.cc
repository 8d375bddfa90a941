#include "agail/env/cartpole.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "agail/base/error.h"

namespace agail {
namespace {

constexpr double kGravity = 9.8;
constexpr double kPoleMass = 0.1;
constexpr double kTotalMass = 0.1 + 1.0;
constexpr double kLength = 0.5;  // half the pole's
constexpr double kPoleMassLength = kPoleMass * kLength;
constexpr double kForce = 10.0;
constexpr double kTimestep = 0.02;
constexpr double kMaxPosition = 2.4;
constexpr double kMaxAngle = 12 * 2 * std::numbers::pi / 360;

}  // namespace

CartPole::CartPole(const std::string& id, int max_episode_steps)
    : Environment(make_spec(id, max_episode_steps)) {}

EnvironmentSpec CartPole::make_spec(const std::string& id, int max_episode_steps) {
  EnvironmentSpec spec;
  spec.id = id;
  spec.observation_dim = 4;
  spec.observation_is_float32 = true;
  spec.action.discrete = true;
  spec.action.dim = 1;
  spec.action.n = 2;
  spec.max_episode_steps = max_episode_steps;
  return spec;
}

void CartPole::do_reset(RandomStream& random) {
  for (double& value : state_) value = random.uniform(-0.05, 0.05);
  ended_ = false;
  observe();
}

// The order of the operations is Gymnasium's: another one would round otherwise.
StepResult CartPole::do_step(std::span<const float> action) {
  AGAIL_CHECK(action[0] == 0.0F || action[0] == 1.0F);
  const auto [x, x_dot, theta, theta_dot] = state_;
  const double force = action[0] == 1.0F ? kForce : -kForce;
  const double cosine = std::cos(theta);
  const double sine = std::sin(theta);
  const double push = (force + kPoleMassLength * (theta_dot * theta_dot) * sine) / kTotalMass;
  const double theta_acc = (kGravity * sine - cosine * push) /
                           (kLength * (4.0 / 3.0 - kPoleMass * (cosine * cosine) / kTotalMass));
  const double x_acc = push - kPoleMassLength * theta_acc * cosine / kTotalMass;
  const std::array<double, 4> next = {x + kTimestep * x_dot, x_dot + kTimestep * x_acc,
                                      theta + kTimestep * theta_dot,
                                      theta_dot + kTimestep * theta_acc};

  StepResult result;
  // The observation is float32, so that is the range in which it must be finite.
  if (!std::ranges::all_of(next, [](double v) { return std::isfinite(static_cast<float>(v)); })) {
    result.diverged = result.terminated = ended_ = true;
    return result;
  }
  state_ = next;
  result.terminated = std::abs(next[0]) > kMaxPosition || std::abs(next[2]) > kMaxAngle;
  result.reward = result.terminated && ended_ ? 0.0 : 1.0;
  ended_ = ended_ || result.terminated;
  observe();
  return result;
}

std::vector<double> CartPole::do_save() const {
  std::vector<double> state(state_.begin(), state_.end());
  state.push_back(ended_ ? 1.0 : 0.0);
  return state;
}

void CartPole::do_restore(std::span<const double> state) {
  std::ranges::copy(state.first(4), state_.begin());
  ended_ = state[4] != 0.0;
  observe();
}

void CartPole::observe() {
  const auto finite = [](double v) { return std::isfinite(static_cast<float>(v)); };
  if (!std::ranges::all_of(state_, finite))
    return;  // a broken state that was restored: see do_step
  std::ranges::transform(state_, observation_.begin(),
                         [](double v) { return static_cast<double>(static_cast<float>(v)); });
}

}  // namespace agail
