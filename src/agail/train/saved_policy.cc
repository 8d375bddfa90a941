#include "agail/train/saved_policy.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>

#include "agail/base/atomic_file.h"
#include "agail/base/crc32c.h"
#include "agail/demos/demonstrations.h"
#include "agail/rl/rollout.h"
#include "agail/train/safetensors.h"

namespace agail {

namespace {

using nlohmann::json;

constexpr const char* kFormat = "agail-policy-1";

template <class T, class Values>
Tensor make_tensor(DType dtype, std::vector<std::size_t> shape, const Values& values) {
  const Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = values;
  Tensor tensor{dtype, std::move(shape),
                std::vector<std::uint8_t>(static_cast<std::size_t>(rows.size()) * sizeof(T))};
  std::memcpy(tensor.bytes.data(), rows.data(), tensor.bytes.size());
  return tensor;
}

template <class T>
RowMatrix<T> read_tensor(const TensorStore& store, const std::string& name, DType dtype, Index rows,
                         Index columns, const std::string& where) {
  const auto found = store.tensors.find(name);
  const std::size_t bytes = static_cast<std::size_t>(rows * columns) * sizeof(T);
  if (found == store.tensors.end() || found->second.dtype != dtype ||
      found->second.bytes.size() != bytes)
    throw InputError(where + ": array '" + name + "' should be " + name_of(dtype) + " of " +
                     std::to_string(rows) + " x " + std::to_string(columns) +
                     "; the file is not a policy of this kind, train or export it again");
  RowMatrix<T> result(rows, columns);
  std::memcpy(result.data(), found->second.bytes.data(), bytes);
  if (!result.allFinite())
    throw InputError(where + ": array '" + name +
                     "' has values that are not finite; train the policy again");
  return result;
}

json bounds(const std::vector<float>& values) {
  json result = json::array();
  for (const float v : values) {
    if (std::isfinite(v))
      result.push_back(v);
    else
      result.push_back(v > 0 ? "inf" : "-inf");
  }
  return result;
}

std::vector<float> bounds(const json& values) {
  std::vector<float> result;
  for (const json& v : values)
    result.push_back(v.is_string() ? (v == "inf" ? HUGE_VALF : -HUGE_VALF) : v.get<float>());
  return result;
}

// How many there are; 0 if that makes no sense. (json converts any number to any type, as it
// comes.)
int count_of(const json& value) {
  constexpr int kLargest = 1 << 20;
  return value.is_number_integer() && value >= 1 && value <= kLargest ? value.get<int>() : 0;
}

Sizes counts_of(const json& values) {
  if (!values.is_array()) return {0};
  Sizes result;
  for (const json& value : values) result.push_back(count_of(value));
  return result;
}

}  // namespace

SavedPolicy::SavedPolicy(PolicyInfo info, int observation_dim, const ActionSpace& action,
                         const Sizes& hidden, const Normalizer& normalizer,
                         Vector<double> standard_deviation, Vector<float> theta)
    : info_(std::move(info)),
      observation_dim_(observation_dim),
      action_(action),
      hidden_(hidden),
      normalizer_(observation_dim, normalizer.enabled(), normalizer.clip()),
      standard_deviation_(std::move(standard_deviation)),
      network_(observation_dim, hidden, action),
      theta_(std::move(theta)) {
  if (normalizer.enabled()) normalizer_.set(normalizer.mean(), standard_deviation_);
}

TensorStore SavedPolicy::store() const {
  TensorStore store;
  const Mlp<float>& mlp = network_.mlp;
  for (Index l = 0; l < mlp.layers(); ++l) {
    const auto out = mlp.sizes()[static_cast<std::size_t>(l) + 1];
    const auto in = mlp.sizes()[static_cast<std::size_t>(l)];
    const Eigen::Map<const Matrix<float>> weights(theta_.data() + mlp.offset(l), out, in + 1);
    const std::string name = "policy." + std::to_string(l);
    const auto rows = static_cast<std::size_t>(out);
    store.tensors[name + ".weight"] =
        make_tensor<float>(DType::kF32, {rows, static_cast<std::size_t>(in)}, weights.leftCols(in));
    store.tensors[name + ".bias"] = make_tensor<float>(DType::kF32, {rows}, weights.rightCols(1));
  }
  if (!action_.discrete)
    store.tensors["policy.log_std"] =
        make_tensor<float>(DType::kF32, {static_cast<std::size_t>(action_.dim)},
                           theta_.tail(network_.distribution.log_stds()));
  const auto dim = static_cast<std::size_t>(observation_dim_);
  if (normalizer_.enabled()) {
    store.tensors["observation.mean"] = make_tensor<double>(DType::kF64, {dim}, normalizer_.mean());
    store.tensors["observation.std"] = make_tensor<double>(DType::kF64, {dim}, standard_deviation_);
  }
  json structure = {{"observation_dim", observation_dim_},
                    {"hidden", hidden_},
                    {"activation", "tanh"},
                    {"observation_clip", normalizer_.clip()},
                    {"normalize_observations", normalizer_.enabled()},
                    {"discrete", action_.discrete},
                    {"action_dim", action_.dim}};
  if (action_.discrete) {
    structure["actions"] = action_.n;
  } else {
    structure["action_low"] = bounds(action_.low);
    structure["action_high"] = bounds(action_.high);
  }
  if (!info_.layout.empty()) structure["layout"] = info_.layout;
  store.metadata = {{"format", kFormat},          {"environment", info_.environment},
                    {"method", info_.method},     {"timesteps", std::to_string(info_.timesteps)},
                    {"settings", info_.settings}, {"structure", structure.dump()}};
  if (info_.demonstrations_mean_return)
    store.metadata["demonstrations_mean_return"] = json(*info_.demonstrations_mean_return).dump();
  return store;
}

std::string SavedPolicy::signature() const {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(theta_.data());
  char text[16];
  std::snprintf(text, sizeof text, "%08x",
                crc32c({bytes, static_cast<std::size_t>(theta_.size()) * sizeof(float)}));
  return text;
}

std::vector<std::uint8_t> SavedPolicy::encode() const { return to_safetensors(store()); }

void SavedPolicy::save(const std::filesystem::path& file) const {
  if (!theta_.allFinite())
    throw InputError(file.string() +
                     " is not written: training diverged, the policy's weights are not finite; "
                     "lower the learning rates");
  write_file_atomically(file, encode());
}

SavedPolicy SavedPolicy::load(const std::filesystem::path& file) {
  return decode(read_file(file), file.string());
}

SavedPolicy SavedPolicy::decode(std::span<const std::uint8_t> bytes, const std::string& where) {
  const TensorStore store = from_safetensors(bytes, where, Checksum::kRequired);
  const auto entry = [&](const char* key) {
    const auto found = store.metadata.find(key);
    return found == store.metadata.end() ? std::string() : found->second;
  };
  if (entry("format") != kFormat)
    throw InputError(where + ": not a policy of agail (format '" + entry("format") +
                     "'); give a run folder or its policy.safetensors");
  try {
    const json structure = json::parse(entry("structure"));
    PolicyInfo info{entry("environment"),
                    entry("method"),
                    std::stoll(entry("timesteps")),
                    entry("settings"),
                    {}};
    if (const std::string mean = entry("demonstrations_mean_return"); !mean.empty())
      info.demonstrations_mean_return = json::parse(mean).get<double>();
    ActionSpace action;
    action.discrete = structure.at("discrete");
    action.dim = count_of(structure.at("action_dim"));
    if (action.discrete) {
      action.n = count_of(structure.at("actions"));
    } else {
      action.low = bounds(structure.at("action_low"));
      action.high = bounds(structure.at("action_high"));
    }
    const int observation_dim = count_of(structure.at("observation_dim"));
    const Sizes hidden = counts_of(structure.at("hidden"));
    const auto dim = static_cast<std::size_t>(action.dim);
    const json layout = structure.value("layout", json::object());
    const bool of_integers = std::all_of(layout.begin(), layout.end(), [](const json& numbers) {
      return std::all_of(numbers.begin(), numbers.end(),
                         [](const json& number) { return number.is_number_integer(); });
    });
    // A shape of `size` numbers in all, or a start; there need not be one.
    const auto shape_fits = [&](const char* name, int size) {
      if (!layout.contains(name)) return true;
      const Sizes sides = counts_of(layout[name]);
      return std::accumulate(sides.begin(), sides.end(), 1.0, std::multiplies<>()) == size;
    };
    const auto start_fits = [&](const char* name) {
      return !layout.contains(name) || layout[name].size() == 1;
    };
    if (observation_dim == 0 || std::count(hidden.begin(), hidden.end(), 0) > 0 ||
        action.dim == 0 ||
        (action.discrete ? action.n == 0 || action.dim != 1
                         : action.low.size() != dim || action.high.size() != dim) ||
        !of_integers || !shape_fits("observation_shape", observation_dim) ||
        !shape_fits("action_shape", action.dim) || !start_fits("observation_start") ||
        !start_fits("action_start"))
      throw InputError(
          where +
          ": the structure in its metadata makes no sense; train or export the policy again");

    info.layout = layout.get<decltype(info.layout)>();
    Normalizer normalizer(observation_dim, structure.at("normalize_observations"),
                          structure.at("observation_clip"));
    Vector<double> standard_deviation = Vector<double>::Ones(observation_dim);
    if (normalizer.enabled()) {
      standard_deviation =
          read_tensor<double>(store, "observation.std", DType::kF64, observation_dim, 1, where);
      normalizer.set(
          read_tensor<double>(store, "observation.mean", DType::kF64, observation_dim, 1, where),
          standard_deviation);
    }
    const PolicyNetwork<float> network(observation_dim, hidden, action);
    if (static_cast<std::size_t>(network.parameters()) > bytes.size() / sizeof(float))
      throw InputError(
          where +
          ": the structure in its metadata is of more weights than the file has; train "
          "or export the policy again");
    Vector<float> theta(network.parameters());
    for (Index l = 0; l < network.mlp.layers(); ++l) {
      const Index out = network.mlp.sizes()[static_cast<std::size_t>(l) + 1];
      const Index in = network.mlp.sizes()[static_cast<std::size_t>(l)];
      const std::string name = "policy." + std::to_string(l);
      Eigen::Map<Matrix<float>> weights(theta.data() + network.mlp.offset(l), out, in + 1);
      weights.leftCols(in) =
          read_tensor<float>(store, name + ".weight", DType::kF32, out, in, where);
      weights.rightCols(1) = read_tensor<float>(store, name + ".bias", DType::kF32, out, 1, where);
    }
    if (!action.discrete)
      theta.tail(action.dim) =
          read_tensor<float>(store, "policy.log_std", DType::kF32, action.dim, 1, where);
    return {std::move(info), observation_dim, action,
            hidden,          normalizer,      std::move(standard_deviation),
            std::move(theta)};
  } catch (const json::exception&) {
    throw InputError(
        where + ": the structure in its metadata is damaged; train or export the policy again");
  } catch (const std::logic_error&) {  // std::stoll
    throw InputError(
        where +
        ": the number of timesteps in its metadata is damaged; train or export the policy again");
  }
}

SavedPolicy::Workspace SavedPolicy::make_workspace() const {
  return {Matrix<float>::Zero(padded(observation_dim_ + 1), 1), network_.mlp.make_tape(1),
          std::vector<float>(static_cast<std::size_t>(observation_dim_))};
}

void SavedPolicy::act(std::span<const double> observation, RandomStream* random,
                      Workspace& workspace, float* action) const {
  std::transform(observation.begin(), observation.end(), workspace.observation.begin(),
                 [](double v) { return static_cast<float>(v); });
  normalizer_.apply(workspace.observation.data(), workspace.input.data());
  network_.mlp.forward(theta_.data(), workspace.input.topRows(observation_dim_ + 1), workspace.tape,
                       0);
  const float* output = workspace.tape.outputs.back().data();
  if (random != nullptr)
    network_.distribution.sample(output, network_.log_std(theta_.data()), *random, action);
  else
    network_.distribution.mode(output, action);
  clip_action(action_, action, action);
}

std::filesystem::path policy_file(const std::filesystem::path& policy) {
  namespace fs = std::filesystem;
  if (!is_there(policy))
    throw InputError(policy.string() +
                     ": no such file or folder; give a run folder or a .safetensors file");
  if (!fs::is_directory(policy)) return policy;
  for (const char* name : {"policy_best.safetensors", "policy.safetensors"})
    if (is_there(policy / name)) return policy / name;
  throw InputError(policy.string() +
                   ": no policy in this folder; give the folder of a run that has saved one, or a "
                   ".safetensors file");
}

}  // namespace agail
