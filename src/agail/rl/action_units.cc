#include "agail/rl/action_units.h"

#include <algorithm>
#include <cmath>

namespace agail {
namespace {

// Bounds beyond this are there only because something has to be.
constexpr double kUnbounded = 1e6;

bool is_kept(double low, double high) {
  const bool bounded = low > -kUnbounded && high < kUnbounded && low < high;
  return !bounded || (low == -high && high >= 0.25 && high <= 1);
}

}  // namespace

ActionUnits::ActionUnits(const ActionSpace& space)
    : environment_(space), space_(space), units_(static_cast<std::size_t>(space.dim)) {
  for (std::size_t i = 0; i < space.low.size(); ++i) {
    const double low = static_cast<double>(space.low[i]), high = static_cast<double>(space.high[i]);
    if (is_kept(low, high)) continue;
    units_[i] = {.centre = (low + high) / 2, .scale = (high - low) / 2, .own = false};
    space_.low[i] = -1;
    space_.high[i] = 1;
  }
}

void ActionUnits::execute(const float* u, float* a) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(environment_.dim); ++i)
    a[i] = units_[i].own
               ? u[i]
               : static_cast<float>(units_[i].centre + units_[i].scale * static_cast<double>(u[i]));
  clip_action(environment_, a, a);
}

float ActionUnits::from_environment(Index entry, float a) const {
  const auto i = static_cast<std::size_t>(entry);
  if (environment_.discrete) return a;
  const float executed = std::clamp(a, environment_.low[i], environment_.high[i]);
  if (units_[i].own) return executed;
  return static_cast<float>((static_cast<double>(executed) - units_[i].centre) / units_[i].scale);
}

Vector<float> ActionUnits::in_environment(const PolicyNetwork<float>& network,
                                          Vector<float> theta) const {
  const auto& mlp = network.mlp;
  const Index last = mlp.layers() - 1, inputs = mlp.sizes()[static_cast<std::size_t>(last)];
  // [W b], outputs x (inputs + 1)
  Eigen::Map<Matrix<float>> weights(theta.data() + mlp.offset(last), mlp.outputs(), inputs + 1);
  for (std::size_t k = 0; k < units_.size(); ++k) {
    const Unit& unit = units_[k];
    if (unit.own) continue;
    const auto i = static_cast<Index>(k);
    for (float& w : weights.row(i)) w = static_cast<float>(unit.scale * static_cast<double>(w));
    weights(i, inputs) = static_cast<float>(unit.centre + static_cast<double>(weights(i, inputs)));
    network.log_std(theta.data())[i] += static_cast<float>(std::log(unit.scale));
  }
  return theta;
}

}  // namespace agail
