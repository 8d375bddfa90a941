// Demonstrations, for agail.Demonstrations.
#include "agail/demos/demonstrations.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <mutex>

#include "agail/demos/mask.h"
#include "agail/demos/minari_reader.h"
#include "agail/demos/minari_writer.h"
#include "agail/train/table_demonstrations.h"
#include "arrays.h"
#include "bind.h"

namespace agail {

namespace nb = nanobind;

namespace {

// HDF5 is used by one thread at a time. Without the GIL: whoever waits for it must not hold it.
template <class F>
auto alone_with_hdf5(F&& f) {
  static std::mutex mutex;
  const nb::gil_scoped_release no_gil;
  const std::lock_guard lock(mutex);
  return f();
}

Demonstrations decode(const nb::bytes& bytes) {
  const std::span data(static_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  return alone_with_hdf5([&] { return read_demonstrations(data, "demonstrations"); });
}

nb::bytes encode(const Demonstrations& demos) {
  const auto bytes = alone_with_hdf5([&] { return encode_demonstrations(demos); });
  return nb::bytes(bytes.data(), bytes.size());
}

Demonstrations masked(Demonstrations demos, double missing, const std::string& pattern,
                      std::uint64_t seed, std::optional<int> dimension) {
  const nb::gil_scoped_release no_gil;
  remove_actions(demos, {mask_pattern(pattern), missing, seed, dimension});
  return demos;
}

RowMatrix<double> matrix(const InputArray<double>& array) {
  return Eigen::Map<const RowMatrix<double>>(array.data(),
                                             static_cast<Eigen::Index>(array.shape(0)),
                                             static_cast<Eigen::Index>(array.shape(1)));
}

// Arrays are checked for shape by the caller (agail/formats/arrays.py).
Demonstrations from_table(const InputArray<double>& observations, const InputArray<double>& actions,
                          const std::optional<InputArray<double>>& next_observations,
                          const std::vector<double>& rewards,
                          const std::vector<double>& terminations,
                          const std::vector<double>& truncations,
                          const std::vector<double>& episodes, bool discrete, bool float32,
                          const std::string& environment, const std::string& where) {
  StepTable table;
  table.where = where;
  table.observations = matrix(observations);
  table.actions = matrix(actions);
  if (next_observations) table.next_observations = matrix(*next_observations);
  table.rewards = rewards;
  table.terminations = terminations;
  table.truncations = truncations;
  if (!episodes.empty()) table.starts = split_at_changes(episodes, table.where);
  table.discrete = discrete;
  table.observations_are_float32 = float32;
  return demonstrations_of(std::move(table), environment);
}

nb::dict episode(const Demonstrations& demos, std::size_t index) {
  const DemoEpisode& e = demos.episodes.at(index);
  const auto rows = static_cast<std::size_t>(e.steps());
  const auto columns = static_cast<std::size_t>(e.actions.cols());
  nb::dict result;
  result["observations"] = copy_array<double>(
      e.observations.data(), {rows + 1, static_cast<std::size_t>(e.observations.cols())});
  result["actions"] = copy_array<double>(e.actions.data(), {rows, columns});
  result["available"] = copy_array<bool>(e.available.data(), {rows, columns});
  if (e.rewards.empty())
    result["rewards"] = nb::none();
  else
    result["rewards"] = copy_array<double>(e.rewards.data(), {rows});
  result["terminations"] = copy_array<bool>(e.terminations.data(), {rows});
  result["truncations"] = copy_array<bool>(e.truncations.data(), {rows});
  return result;
}

}  // namespace

void bind_demonstrations(nb::module_& module) {
  nb::class_<Demonstrations>(module, "Demonstrations", "See agail.Demonstrations.")
      .def_static(
          "load",
          [](const std::string& path) {
            return alone_with_hdf5([&] { return read_demonstrations(path); });
          },
          nb::arg("path_or_id"))
      .def(
          "save",
          [](const Demonstrations& demos, const std::string& path) {
            alone_with_hdf5([&] { write_demonstrations(demos, path); });
          },
          nb::arg("path"))
      .def_static("decode", &decode, nb::arg("data"))
      .def("encode", &encode)
      .def_static("from_table", &from_table, nb::arg("observations"), nb::arg("actions"),
                  nb::arg("next_observations").none(), nb::arg("rewards"), nb::arg("terminations"),
                  nb::arg("truncations"), nb::arg("episodes"), nb::arg("discrete"),
                  nb::arg("float32"), nb::arg("environment"), nb::arg("where"))
      .def("masked", &masked, nb::arg("missing"), nb::arg("pattern"), nb::arg("seed"),
           nb::arg("dimension").none())
      .def("episode", &episode, nb::arg("index"))
      .def("__len__", [](const Demonstrations& demos) { return demos.episodes.size(); })
      .def_prop_ro("environment", [](const Demonstrations& demos) { return demos.environment; })
      .def_prop_ro("observation_dim",
                   [](const Demonstrations& demos) { return demos.observation_dim; })
      .def_prop_ro("action_dim", [](const Demonstrations& demos) { return demos.action.dim; })
      .def_prop_ro("discrete", [](const Demonstrations& demos) { return demos.action.discrete; })
      .def_prop_ro("float32",
                   [](const Demonstrations& demos) { return demos.observations_are_float32; })
      .def_prop_ro("transitions", &Demonstrations::transitions)
      .def_prop_ro("missing_ratio", &Demonstrations::missing_ratio)
      .def_prop_ro("pattern", [](const Demonstrations& demos) { return demos.pattern; })
      .def_prop_ro("mean_return", [](const Demonstrations& demos) -> std::optional<double> {
        if (!demos.has_rewards()) return std::nullopt;
        return demos.mean_return();
      });
}

}  // namespace agail
