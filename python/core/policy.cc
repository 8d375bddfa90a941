// agail.Policy.
#include "policy.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <atomic>
#include <mutex>
#include <span>
#include <string_view>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "bind.h"

namespace agail {

namespace nb = nanobind;

namespace {

// The numbers of a C-contiguous array. This and NumPy::empty take a third of the time that
// nb::ndarray takes for the way in and out, which is longer than a small network's.
class Buffer {
 public:
  // Not valid if `array` has no buffer, or one of another format (of Python's module struct).
  Buffer(nb::handle array, std::string_view format) {
    if (PyObject_GetBuffer(array.ptr(), &view_, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS) != 0)
      PyErr_Clear();
    else
      valid_ = view_.format != nullptr && format == view_.format;
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() { PyBuffer_Release(&view_); }

  bool valid() const { return valid_; }
  template <class T>
  T* data() const {
    AGAIL_CHECK(valid_);
    return static_cast<T*>(view_.buf);
  }
  std::span<const Py_ssize_t> shape() const {
    return {view_.shape, static_cast<std::size_t>(view_.ndim)};
  }

 private:
  Py_buffer view_{};
  bool valid_ = false;
};

// What predict() needs of NumPy, looked up once.
class NumPy {
 public:
  enum Type { kFloat32, kInt64 };

  // An uninitialised array.
  nb::object empty(const nb::tuple& shape, Type type) {
    if (!empty_.is_valid()) {
      const nb::module_ numpy = nb::module_::import_("numpy");
      types_[kFloat32] = numpy.attr("dtype")("float32");
      types_[kInt64] = numpy.attr("dtype")("int64");
      empty_ = numpy.attr("empty");
    }
    return empty_(shape, types_[type]);
  }

  // A copy, as only a new array is sure to be aligned.
  static nb::object as_float64(const nb::object& numbers) {
    return nb::module_::import_("numpy").attr("array")(numbers, "float64", nb::arg("order") = "C");
  }

 private:
  nb::object empty_;
  std::array<nb::object, 2> types_;
};

// Several threads may use one policy.
class Policy {
 public:
  explicit Policy(SavedPolicy policy) : policy_(std::move(policy)) {}

  static std::unique_ptr<Policy> load(const std::filesystem::path& path) {
    const nb::gil_scoped_release no_gil;
    return std::make_unique<Policy>(SavedPolicy::load(policy_file(path)));
  }

  const SavedPolicy& saved() const { return policy_; }

  // Names the random numbers of stochastic actions from here on.
  void seed(const nb::object& seed) {
    std::uint64_t number = 0;
    if (!nb::try_cast(seed, number))
      throw InputError("seed = " + std::string(nb::repr(seed).c_str()) +
                       " should be a whole number of at least 0 and below 2**64");
    seed_ = number;
    draws_ = 0;
  }

  nb::tuple predict(const nb::object& observation, const nb::object& state, const nb::object&,
                    bool deterministic) {
    if (policy_.info().layout.empty())
      return nb::make_tuple(flat_actions(observation, deterministic), state);
    if (!layout_.is_valid())
      layout_ = nb::module_::import_("agail._layout")
                    .attr("PolicyLayout")(policy_.info().layout, policy_.observation_dim(),
                                          policy_.action().dim, policy_.action().discrete);
    const nb::object found = layout_.attr("rows")(observation);
    const nb::object rows = found[0], single = found[1];
    const nb::object actions = flat_actions(rows, deterministic);
    return nb::make_tuple(layout_.attr("own_actions")(actions, single), state);
  }

  // Of one observation or a batch, all numbers in a row and counted from 0.
  nb::object flat_actions(const nb::object& observation, bool deterministic) {
    std::optional<Buffer> input(std::in_place, observation, "d");
    if (!input->valid()) input.emplace(NumPy::as_float64(observation), "d");
    const std::span<const Py_ssize_t> shape = input->shape();
    const Index dim = policy_.observation_dim();
    const bool single = shape.size() == 1;
    if (shape.empty() || shape.size() > 2 || shape.back() != dim)
      throw InputError("this policy takes observations of shape (" + std::to_string(dim) +
                       ",) or (n, " + std::to_string(dim) + "), not " + text_of(shape));
    const auto n = static_cast<std::size_t>(single ? 1 : shape[0]);
    const auto* rows = input->data<const double>();
    if (policy_.action().discrete) {
      std::vector<float> indices(n);
      act(rows, n, indices.data(), deterministic);
      const nb::object actions =
          numpy_.empty(single ? nb::make_tuple() : nb::make_tuple(n), NumPy::kInt64);
      std::copy(indices.begin(), indices.end(), Buffer(actions, "l").data<std::int64_t>());
      return single ? nb::object(actions[nb::make_tuple()]) : actions;  // a number, not an array
    }
    const int width = policy_.action().dim;
    const nb::object actions =
        numpy_.empty(single ? nb::make_tuple(width) : nb::make_tuple(n, width), NumPy::kFloat32);
    act(rows, n, Buffer(actions, "f").data<float>(), deterministic);
    return actions;
  }

 private:
  static std::string text_of(std::span<const Py_ssize_t> shape) {
    std::string text = "(";
    for (std::size_t i = 0; i < shape.size(); ++i)
      text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
    return text + (shape.size() == 1 ? ",)" : ")");
  }

  void act(const double* observations, std::size_t n, float* actions, bool deterministic) {
    constexpr std::size_t kFew = 8;  // not worth letting other threads run
    std::optional<nb::gil_scoped_release> no_gil;
    if (n > kFew) no_gil.emplace();
    const Loan loan(*this);
    const auto dim = static_cast<std::size_t>(policy_.observation_dim());
    const auto width = static_cast<std::size_t>(policy_.action().dim);
    for (std::size_t i = 0; i < n; ++i) {
      const std::span<const double> row(observations + i * dim, dim);
      std::optional<RandomStream> random;
      if (!deterministic) {
        const std::uint64_t draw = draws_++;
        random.emplace(seed_, Purpose::kPredict, static_cast<std::uint32_t>(draw >> 32),
                       static_cast<std::uint32_t>(draw));
      }
      policy_.act(row, random ? &*random : nullptr, loan.workspace(), actions + i * width);
    }
  }

  // A workspace for one call.
  class Loan {
   public:
    explicit Loan(Policy& policy) : policy_(policy) {
      const std::lock_guard lock(policy_.mutex_);
      if (policy_.idle_.empty()) {
        workspace_ = std::make_unique<SavedPolicy::Workspace>(policy_.policy_.make_workspace());
      } else {
        workspace_ = std::move(policy_.idle_.back());
        policy_.idle_.pop_back();
      }
    }
    ~Loan() {
      const std::lock_guard lock(policy_.mutex_);
      policy_.idle_.push_back(std::move(workspace_));
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    SavedPolicy::Workspace& workspace() const { return *workspace_; }

   private:
    Policy& policy_;
    std::unique_ptr<SavedPolicy::Workspace> workspace_;
  };

  SavedPolicy policy_;
  nb::object layout_;  // agail._layout.PolicyLayout, made when it is first needed
  NumPy numpy_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<SavedPolicy::Workspace>> idle_;
  std::atomic<std::uint64_t> seed_ = 0, draws_ = 0;
};

nb::bytes encode(const Policy& policy) {
  const std::vector<std::uint8_t> bytes = policy.saved().encode();
  return nb::bytes(bytes.data(), bytes.size());
}

// Name to array.
nb::dict tensors(const Policy& policy) {
  nb::dict result;
  for (const auto& [name, tensor] : policy.saved().store().tensors) {
    const nb::object array =
        nb::module_::import_("numpy")
            .attr("frombuffer")(nb::bytes(tensor.bytes.data(), tensor.bytes.size()),
                                tensor.dtype == DType::kF64 ? "float64" : "float32")
            .attr("reshape")(nb::cast(tensor.shape));
    result[name.c_str()] = array;
  }
  return result;
}

nb::dict metadata(const Policy& policy) {
  nb::dict result;
  for (const auto& [key, value] : policy.saved().store().metadata) result[key.c_str()] = value;
  return result;
}

SavedPolicy decode(const nb::bytes& bytes) {
  return SavedPolicy::decode({static_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                             "the pickled policy");
}

constexpr const char* kPredictSignature =
    "def predict(self, observation: numpy.typing.ArrayLike, state: object = None, "
    "episode_start: object = None, deterministic: bool = True) -> "
    "tuple[numpy.typing.NDArray[typing.Any], object]";

constexpr const char* kPredictHelp =
    R"(The action for one observation of the environment, or for a batch of them.

Returns (action, state) as stable-baselines3 does; state comes back as it was given, these policies have none, and
episode_start is not used. Observations and actions are as the environment has them: a batch is (n, *shape), (n,) of a
Discrete space. Observations of shape (observation_dim,) or (n, observation_dim) will do for a Box of any shape, one-hot
rows (n, observation_dim) for a Discrete space. Continuous actions are float32, within the bounds; discrete ones int64.
The mode, or a sample if not deterministic. Observations are normalised here. A batch gives the same bits as its rows
one by one. InputError (a ValueError) for other shapes.)";

}  // namespace

const SavedPolicy& saved_policy(nb::handle policy) { return nb::cast<Policy&>(policy).saved(); }

void bind_policy(nb::module_& module) {
  nb::class_<Policy>(module, "Policy",
                     "A trained policy. Picklable; several threads may use one at once.")
      .def_static("load", &Policy::load, nb::arg("path"),
                  "A run folder (its best policy for trpo, the last one for other methods) or a "
                  ".safetensors file. InputError if it is neither.")
      .def(
          "save",
          [](const Policy& policy, const std::filesystem::path& path) {
            create_output_folder(path.parent_path());
            policy.saved().save(path);
          },
          nb::arg("path"), "Writes one .safetensors file, and makes its folder if there is none.")
      .def("predict", &Policy::predict, nb::arg("observation"), nb::arg("state") = nb::none(),
           nb::arg("episode_start") = nb::none(), nb::arg("deterministic") = true,
           nb::sig(kPredictSignature), kPredictHelp)
      .def("_predict_rows", &Policy::flat_actions, nb::arg("observation"),
           nb::arg("deterministic") = true,
           "The actions for observations as numbers in a row, (D,) or (n, D), counted from 0.")
      .def("seed", &Policy::seed, nb::arg("seed").none(),
           nb::sig("def seed(self, seed: int) -> None"),
           "Names the random numbers of stochastic actions from here on.")
      .def("tensors", &tensors,
           nb::sig("def tensors(self) -> dict[str, numpy.typing.NDArray[typing.Any]]"),
           "The arrays of its file, by name: docs/files.md.")
      .def("metadata", &metadata, nb::sig("def metadata(self) -> dict[str, str]"),
           "What its file says of itself: environment, method, settings, structure (JSON)...")
      .def("__getstate__", &encode)
      .def("__setstate__",
           [](Policy& policy, const nb::bytes& bytes) { new (&policy) Policy(decode(bytes)); })
      .def_prop_ro(
          "environment", [](const Policy& policy) { return policy.saved().info().environment; },
          "Id of the environment that it was trained for.")
      .def_prop_ro(
          "method", [](const Policy& policy) { return policy.saved().info().method; },
          "trpo gail state-gail agail bc bco")
      .def_prop_ro(
          "timesteps", [](const Policy& policy) { return policy.saved().info().timesteps; },
          "Environment steps that it learned from.")
      .def_prop_ro(
          "settings_toml", [](const Policy& policy) { return policy.saved().info().settings; },
          "All settings of its training, as TOML.")
      .def_prop_ro(
          "demonstrations_mean_return",
          [](const Policy& policy) { return policy.saved().info().demonstrations_mean_return; },
          "Mean return of the demonstrations, or None.")
      .def_prop_ro("observation_dim",
                   [](const Policy& policy) { return policy.saved().observation_dim(); })
      .def_prop_ro(
          "action_dim", [](const Policy& policy) { return policy.saved().action().dim; },
          "Numbers of an action; 1 if discrete.")
      .def_prop_ro(
          "n_actions", [](const Policy& policy) { return policy.saved().action().n; },
          "Number of discrete actions, 0 if continuous.")
      .def_prop_ro("hidden", [](const Policy& policy) { return policy.saved().hidden(); });
}

}  // namespace agail
