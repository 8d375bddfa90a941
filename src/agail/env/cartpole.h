// The cart and pole of Barto, Sutton and Anderson (1983), as Gymnasium computes it: state in double
// precision, Euler steps of 0.02 s, observations rounded to float32.
#pragma once

#include <array>

#include "agail/env/environment.h"

namespace agail {

class CartPole final : public Environment {
 public:
  CartPole(const std::string& id, int max_episode_steps);
  static EnvironmentSpec make_spec(const std::string& id, int max_episode_steps);

  // Cart position (m) and velocity (m/s), pole angle (rad, 0 upright) and angular velocity (rad/s).
  std::span<const double> observation() const override { return observation_; }

 protected:
  void do_reset(RandomStream& random) override;
  StepResult do_step(std::span<const float> action) override;  // 0 pushes left, 1 right
  // The four numbers of the observation in double precision; 1 if the episode has already ended,
  // else 0.
  std::vector<double> do_save() const override;
  void do_restore(std::span<const double> state) override;

 private:
  void observe();

  std::array<double, 4> state_{};
  std::array<double, 4> observation_{};
  bool ended_ = false;  // further steps are rewarded with 0
};

}  // namespace agail
