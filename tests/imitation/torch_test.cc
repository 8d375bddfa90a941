// Gradients against PyTorch's autograd, on the numbers that tests/tools/torch_reference.py wrote.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "agail/imitation/discriminator.h"
#include "agail/rl/policy_objective.h"
#include "rl/support.h"

namespace agail {
namespace {

using nlohmann::json;

json fixture() {
  std::ifstream file(AGAIL_TORCH_REFERENCE);
  return json::parse(file);
}

Vector<double> vector(const json& values) {
  const auto numbers = values.get<std::vector<double>>();
  return Eigen::Map<const Vector<double>>(numbers.data(), static_cast<Index>(numbers.size()));
}

// With `ones`, a last row of ones is added.
Matrix<double> matrix(const json& values, Index rows, bool ones) {
  const Vector<double> flat = vector(values);
  Matrix<double> result = Matrix<double>::Ones(rows + (ones ? 1 : 0), flat.size() / rows);
  result.topRows(rows) = flat.reshaped(rows, flat.size() / rows);
  return result;
}

TEST(Torch, SurrogateGradientAndFisherVectorProduct) {
  ThreadPool pool(1);
  const json file = fixture();
  ASSERT_EQ(file.at("policies").size(), 2U);
  for (const json& data : file.at("policies")) {
    const auto sizes = data.at("sizes").get<std::vector<int>>();
    const bool discrete = data.at("discrete").get<bool>();
    const ActionSpace space =
        discrete ? discrete_actions(sizes.back()) : continuous_actions(sizes.back());
    const PolicyNetwork<double> network(sizes.front(), {sizes[1], sizes[2]}, space);
    const Vector<double> advantages = vector(data.at("advantages"));
    const Matrix<double> x = matrix(data.at("x"), sizes.front(), true);
    const Matrix<double> actions = matrix(data.at("actions"), space.dim, false);
    PolicyObjective<double> objective(network, pool, x.cols(), 1);
    objective.bind(vector(data.at("theta")), x, actions, advantages, x.cols(),
                   data.at("entropy_weight").get<double>());
    EXPECT_LE(reference::relative_error(objective.gradient(), vector(data.at("gradient"))), 1e-12);
    Vector<double> product(network.parameters());
    objective.fisher_vector_product(vector(data.at("v")), product);
    EXPECT_LE(reference::relative_error(product, vector(data.at("fisher_vector_product"))), 1e-12);
  }
}

TEST(Torch, DiscriminatorGradientWithPenalty) {
  ThreadPool pool(1);
  const json file = fixture();
  const json& data = file.at("discriminator");
  const auto sizes = data.at("sizes").get<std::vector<int>>();
  const Mlp<double> mlp(sizes, Activation::kTanh);
  const Matrix<double> x = matrix(data.at("x"), sizes.front(), true);
  const Matrix<double> between = matrix(data.at("between"), sizes.front(), true);
  DiscriminatorSettings settings;
  settings.minibatch = between.cols();
  settings.entropy_weight = data.at("entropy_weight").get<double>();
  settings.gradient_penalty = data.at("gradient_penalty").get<double>();
  DiscriminatorLoss<double> loss(mlp, settings, pool);
  Vector<double> gradient(mlp.parameters());
  const DiscriminatorReport report = loss.gradient(vector(data.at("theta")), x, between, gradient);
  EXPECT_NEAR(report.loss, data.at("loss").get<double>(), 1e-12);
  EXPECT_LE(reference::relative_error(gradient, vector(data.at("gradient"))), 1e-12);
}

}  // namespace
}  // namespace agail
