// Whatever the arrays and metadata of a policy file hold, reading it gives a policy that acts or an
// InputError. Every input is a policy that nobody trained with some things changed, under a
// checksum that fits: mutations of a file's bytes would end at that.
#include <fuzzer/FuzzedDataProvider.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "agail/base/error.h"
#include "agail/train/safetensors.h"
#include "agail/train/saved_policy.h"
#include "train/plain_policy.h"

namespace {

using nlohmann::json;

agail::TensorStore start(bool discrete) {
  agail::ActionSpace action;
  action.discrete = discrete;
  if (discrete) {
    action.n = 3;
  } else {
    action.dim = 2;
    action.low = {-1, -2};
    action.high = {1, 2};
  }
  return agail::plain_policy({"CartPole-v1", "agail", 7, "", 1.0, {}}, 3, action, true).store();
}

// Of ASCII: what is not UTF-8 cannot be written.
std::string text(FuzzedDataProvider& data) {
  std::string result = data.ConsumeRandomLengthString(64);
  for (char& c : result) c = static_cast<char>(c & 127);
  return result;
}

json number_or_so(FuzzedDataProvider& data) {
  switch (data.ConsumeIntegralInRange(0, 7)) {
    case 0:
      return data.ConsumeIntegral<std::int64_t>();
    case 1:
      return data.ConsumeIntegralInRange(-2, 6);
    case 2:
      return data.ConsumeFloatingPoint<double>();
    case 3:
      return text(data);
    case 4:
      return data.ConsumeBool();
    case 5:
      return nullptr;
    case 6:
      return json::object({{"action_shape", {data.ConsumeIntegralInRange(-1, 4)}}});
    default: {
      json list = json::array();
      while (data.remaining_bytes() > 0 && data.ConsumeBool())
        list.push_back(data.ConsumeIntegral<std::int32_t>());
      return list;
    }
  }
}

void change(FuzzedDataProvider& data, agail::TensorStore& store) {
  const auto any = [&](auto& map) {
    return std::next(map.begin(), data.ConsumeIntegralInRange<std::ptrdiff_t>(
                                      0, static_cast<std::ptrdiff_t>(map.size()) - 1));
  };
  switch (data.ConsumeIntegralInRange(0, 4)) {
    case 0:
      any(store.metadata)->second = text(data);
      break;
    case 1: {
      constexpr std::array<const char*, 10> kKeys = {
          "observation_dim", "hidden",     "observation_clip", "normalize_observations",
          "discrete",        "action_dim", "action_low",       "action_high",
          "actions",         "layout"};
      json structure = json::parse(store.metadata["structure"], nullptr, false);
      if (!structure.is_object()) break;
      structure[data.PickValueInArray(kKeys)] = number_or_so(data);
      store.metadata["structure"] = structure.dump();
      break;
    }
    case 2:
      if (store.tensors.size() > 1) store.tensors.erase(any(store.tensors));
      break;
    default: {
      agail::Tensor& tensor = any(store.tensors)->second;
      const auto values = data.ConsumeIntegralInRange<std::size_t>(0, 20);
      tensor.dtype = data.PickValueInArray(
          {agail::DType::kF32, agail::DType::kF64, agail::DType::kI64, agail::DType::kU8});
      tensor.shape = {values};
      tensor.bytes = data.ConsumeBytes<std::uint8_t>(values * agail::size_of(tensor.dtype));
      tensor.bytes.resize(values * agail::size_of(tensor.dtype));
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  agail::TensorStore store = start(data.ConsumeBool());
  while (data.remaining_bytes() > 0) change(data, store);
  try {
    const agail::SavedPolicy policy =
        agail::SavedPolicy::decode(agail::to_safetensors(store), "input");
    agail::SavedPolicy::Workspace workspace = policy.make_workspace();
    const std::vector<double> observation(static_cast<std::size_t>(policy.observation_dim()));
    std::vector<float> action(static_cast<std::size_t>(policy.action().dim));
    policy.act(observation, nullptr, workspace, action.data());
    agail::SavedPolicy::decode(policy.encode(), "again");
  } catch (const agail::InputError&) {
  }
  return 0;
}
