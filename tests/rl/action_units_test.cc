#include "agail/rl/action_units.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "agail/env/environment.h"

namespace agail {
namespace {

ActionSpace box(std::vector<float> low, std::vector<float> high) {
  ActionSpace space;
  space.dim = static_cast<int>(low.size());
  space.low = std::move(low);
  space.high = std::move(high);
  return space;
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(ActionUnits, BuiltInEnvironmentsKeepTheirs) {
  for (const std::string& id : environment_ids()) {
    const ActionSpace space = environment_spec(id).action;
    EXPECT_EQ(ActionUnits(space).space(), space) << id;
  }
  const ActionSpace open = box({-kInfinity, -1e30F, 0}, {kInfinity, 1e30F, kInfinity});
  EXPECT_EQ(ActionUnits(open).space(), open);
}

TEST(ActionUnits, BoundsBecomeOne) {
  const ActionSpace space = box({0, 50, -2, -0.01F, -1, 3}, {255, 100, 2, 0.01F, 1, kInfinity});
  const ActionUnits units(space);
  EXPECT_EQ(units.space().low, std::vector<float>({-1, -1, -1, -1, -1, 3}));
  EXPECT_EQ(units.space().high, std::vector<float>({1, 1, 1, 1, 1, kInfinity}));

  const std::vector<float> u = {-1, 0.5F, 3, 0, -3, 2};
  std::vector<float> a(u.size());
  units.execute(u.data(), a.data());
  EXPECT_EQ(a, std::vector<float>({0, 87.5F, 2, 0, -1, 3}));  // within the bounds
  EXPECT_FLOAT_EQ(units.from_environment(0, 255), 1);
  EXPECT_FLOAT_EQ(units.from_environment(1, 87.5F), 0.5F);
  EXPECT_FLOAT_EQ(units.from_environment(3, 0.005F), 0.5F);
  EXPECT_EQ(units.from_environment(5, 7), 7);
}

// Means and deviations of the policy in the environment's units are those of u, converted.
TEST(ActionUnits, BecomePartOfThePolicy) {
  const ActionSpace space = box({0, -1, -40}, {255, 1, -20});
  const ActionUnits units(space);
  const PolicyNetwork<float> network(4, {7}, space);
  Vector<float> theta(network.parameters());
  RandomStream random(1, Purpose::kInitialise);
  for (float& value : theta) value = static_cast<float>(random.normal());
  const Vector<float> folded = units.in_environment(network, theta);

  Matrix<float> x = Matrix<float>::Ones(padded(5), 1);
  x.col(0).head(4) << 0.3F, -1, 0.7F, 2;
  const auto mean = [&](const Vector<float>& parameters) {
    Tape<float> tape = network.mlp.make_tape(1);
    network.mlp.forward(parameters.data(), x.topRows(5), tape, 0);
    return Vector<float>(network.mlp.output(tape, 0, 1));
  };
  const Vector<float> u = mean(theta), a = mean(folded);
  EXPECT_NEAR(a[0], 127.5F + 127.5F * u[0], 1e-3);
  EXPECT_EQ(a[1], u[1]);
  EXPECT_NEAR(a[2], -30 + 10 * u[2], 1e-4);
  const float* log_std = network.log_std(theta.data());
  const float* folded_log_std = network.log_std(folded.data());
  EXPECT_NEAR(folded_log_std[0], log_std[0] + std::log(127.5F), 1e-6);
  EXPECT_EQ(folded_log_std[1], log_std[1]);
  EXPECT_NEAR(folded_log_std[2], log_std[2] + std::log(10.0F), 1e-6);
}

}  // namespace
}  // namespace agail
