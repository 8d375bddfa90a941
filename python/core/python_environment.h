// Environments written in Python, for the core.
#pragma once

#include <nanobind/nanobind.h>

#include "agail/env/environment.h"

namespace agail {

// Environments by way of a Python object (agail._source.Source) with
//   spec(id) -> None, or a dict: id, observation_dim, float32, layout (agail/_layout.py), and low,
//     high (Box) or n (Discrete)
//   make(id) -> None, or an object (agail._source.Lane) with
//     action    float32 array that holds the action when step() is called
//     reset(seed) -> observation        float64, one-dimensional
//     step() -> (observation, reward, terminated, truncated)
//     close()
// An exception of these is a PythonFailure. Must be made and destroyed with the GIL held, and be
// used without.
class PythonSource final : public EnvironmentSource {
 public:
  explicit PythonSource(nanobind::object source) : source_(std::move(source)) {}
  std::unique_ptr<Environment> make(const std::string& id) override;
  std::optional<EnvironmentSpec> spec(const std::string& id) override;

 private:
  nanobind::object source_;
};

}  // namespace agail
