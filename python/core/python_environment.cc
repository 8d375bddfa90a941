#include "python_environment.h"

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <cstdio>

#include "arrays.h"
#include "errors.h"

namespace agail {

namespace nb = nanobind;

namespace {

// Calls into Python with the GIL held.
template <class F>
auto in_python(F&& f) {
  const nb::gil_scoped_acquire gil;
  try {
    return f();
  } catch (const nb::python_error& error) {
    throw PythonFailure(error);
  }
}

EnvironmentSpec spec_from(const nb::dict& dict) {
  EnvironmentSpec spec;
  spec.id = nb::cast<std::string>(dict["id"]);
  spec.observation_dim = nb::cast<int>(dict["observation_dim"]);
  spec.observation_is_float32 = nb::cast<bool>(dict["float32"]);
  spec.layout = nb::cast<decltype(spec.layout)>(dict["layout"]);
  spec.action.discrete = dict.contains("n");
  if (spec.action.discrete) {
    spec.action.dim = 1;
    spec.action.n = nb::cast<int>(dict["n"]);
  } else {
    spec.action.low = nb::cast<std::vector<float>>(dict["low"]);
    spec.action.high = nb::cast<std::vector<float>>(dict["high"]);
    spec.action.dim = static_cast<int>(spec.action.low.size());
  }
  return spec;
}

class PythonEnvironment final : public Environment {
 public:
  // With the GIL held.
  PythonEnvironment(EnvironmentSpec spec, nb::object lane)
      : Environment(std::move(spec)),
        lane_(std::move(lane)),
        reset_(lane_.attr("reset")),
        step_(lane_.attr("step")),
        action_(nb::cast<nb::ndarray<float, nb::ndim<1>>>(lane_.attr("action"))),
        observation_(static_cast<std::size_t>(this->spec().observation_dim)) {}

  ~PythonEnvironment() override {
    const nb::gil_scoped_acquire gil;
    try {
      lane_.attr("close")();
    } catch (nb::python_error& error) {
      error.discard_as_unraisable("closing an environment");
    }
    lane_.reset();
    reset_.reset();
    step_.reset();
    action_ = {};
  }

  std::span<const double> observation() const override { return observation_; }

 protected:
  void do_reset(RandomStream& random) override {
    const std::uint32_t seed = random.bits() >> 1;  // some environments take 31 bits only
    in_python([&] { observe(reset_(seed), "reset"); });
  }

  StepResult do_step(std::span<const float> action) override {
    return in_python([&] {
      std::ranges::copy(action, action_.data());
      const nb::object result = step_();
      StepResult step;
      observe(result[0], "step");
      step.reward = nb::cast<double>(result[1]);
      step.terminated = nb::cast<bool>(result[2]);
      step.truncated = nb::cast<bool>(result[3]);
      if (!std::isfinite(step.reward))
        throw InputError("environment " + spec().id + ": step() returned the reward " +
                         std::to_string(step.reward) + " in step " +
                         std::to_string(elapsed_steps() + 1) +
                         " of an episode; rewards must be finite");
      return step;
    });
  }

  // Gymnasium has no way to ask for the state.
  bool can_save() const override { return false; }
  std::vector<double> do_save() const override { return {}; }
  void do_restore(std::span<const double>) override {}

 private:
  void observe(const nb::object& value, const char* call) {
    const auto array = nb::cast<InputArray<double>>(value);
    if (array.size() != observation_.size())
      throw InputError("environment " + spec().id + ": " + call + "() returned an observation of " +
                       std::to_string(array.size()) + " numbers, its observation_space has " +
                       std::to_string(observation_.size()));
    for (std::size_t i = 0; i < observation_.size(); ++i) {
      const double number = array.data()[i];
      if (std::isfinite(static_cast<float>(number))) continue;
      char digits[32];
      std::snprintf(digits, sizeof digits, "%g", number);
      throw InputError("environment " + spec().id + ": " + call +
                       "() returned an observation with " + digits + " at index " +
                       std::to_string(i) + " after " + std::to_string(elapsed_steps()) +
                       " steps of an episode; " +
                       (std::isfinite(number) ? "that is too large for float32, use other units"
                                              : "observations must be finite"));
    }
    std::copy_n(array.data(), array.size(), observation_.data());
  }

  nb::object lane_, reset_, step_;
  nb::ndarray<float, nb::ndim<1>> action_;
  std::vector<double> observation_;
};

}  // namespace

std::unique_ptr<Environment> PythonSource::make(const std::string& id) {
  return in_python([&]() -> std::unique_ptr<Environment> {
    const nb::object lane = source_.attr("make")(id);
    if (lane.is_none()) return nullptr;
    return std::make_unique<PythonEnvironment>(
        spec_from(nb::cast<nb::dict>(source_.attr("spec")(id))), lane);
  });
}

std::optional<EnvironmentSpec> PythonSource::spec(const std::string& id) {
  return in_python([&]() -> std::optional<EnvironmentSpec> {
    const nb::object spec = source_.attr("spec")(id);
    if (spec.is_none()) return std::nullopt;
    return spec_from(nb::cast<nb::dict>(spec));
  });
}

}  // namespace agail
