// Training, evaluation, recording, and the command line.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "agail/base/interrupt.h"
#include "agail/base/thread_pool.h"
#include "agail/config/resolve.h"
#include "agail/train/evaluation.h"
#include "agail/train/run.h"
#include "agail/train/run_log.h"
#include "agail/train/task_request.h"
#include "arrays.h"
#include "bind.h"
#include "command_line.h"
#include "errors.h"
#include "policy.h"
#include "python_environment.h"

namespace agail {

namespace nb = nanobind;

namespace {

// The source of environments for this thread, or none, and no GIL meanwhile.
class OutsidePython {
 public:
  explicit OutsidePython(PythonSource& source) : scope_(source) {}

 private:
  EnvironmentScope scope_;
  nb::gil_scoped_release no_gil_;
};

// Tells a Python function of each update. Its exceptions stop the run, and come out when it has
// been wound up.
class UpdateCallback {
 public:
  explicit UpdateCallback(nb::object function)
      : function_(std::move(function)), names_(progress_columns()) {}

  // Without the GIL. False: stop.
  bool operator()(std::span<const double> row) {
    const nb::gil_scoped_acquire gil;
    try {
      if (PyErr_CheckSignals() != 0) nb::raise_python_error();
      if (function_.is_none()) return true;
      nb::dict values;
      for (std::size_t i = 0; i < row.size(); ++i) values[names_[i].c_str()] = row[i];
      const nb::object answer = function_(values);
      if (answer.is_none()) return true;
      const int truth = PyObject_IsTrue(answer.ptr());  // NumPy's False is no bool
      if (truth < 0) nb::raise_python_error();
      return truth != 0;
    } catch (const nb::python_error& error) {
      failure_.emplace(error);
      return false;
    }
  }

  void rethrow() const {
    if (failure_) throw PythonFailure(*failure_);
  }

 private:
  nb::object function_;
  std::vector<std::string> names_;
  std::optional<PythonFailure> failure_;
};

// Returns (signal, stopped): the signal that interrupted it or 0, and whether the callback stopped
// it.
std::pair<int, bool> train(const std::string& environment, const std::string& method,
                           const Demonstrations* demonstrations, const std::string& out,
                           const std::string& preset, const std::vector<std::string>& assignments,
                           std::int64_t timesteps, std::int64_t lanes, std::uint64_t seed,
                           int threads, bool resume, bool progress, const nb::object& callback,
                           const nb::object& source) {
  PythonSource environments(source);
  UpdateCallback on_update(callback);
  const RunOutcome outcome = [&] {
    const OutsidePython outside(environments);
    TrainingTask task = make_training_task(
        {environment, method, preset, assignments, timesteps, lanes, seed, threads});
    if (demonstrations != nullptr) task.demonstrations = *demonstrations;
    return run_training(std::move(task), out, {resume, progress, std::ref(on_update)});
  }();
  on_update.rethrow();
  return {outcome.signal, outcome.stopped};
}

std::int64_t batch_steps(const std::string& environment, const std::string& preset,
                         const std::vector<std::string>& assignments) {
  return resolve_settings({preset, environment, assignments}).run.batch_steps;
}

// Runs episodes(stops_on_signals) outside of Python. Returns (0, in_python(what it returned)), or
// (the signal that came meanwhile, None). A run whose callback evaluates answers its signals
// itself, when it has saved a checkpoint.
template <class Episodes, class InPython>
nb::tuple until_a_signal(const nb::object& source, Episodes&& episodes, InPython&& in_python) {
  PythonSource environments(source);
  const InterruptGuard guard;
  try {
    auto result = [&] {
      const OutsidePython outside(environments);
      return episodes(guard.alone());
    }();
    if (!guard.alone() || interrupted() == 0)
      return nb::make_tuple(0, in_python(std::move(result)));
  } catch (const EpisodesInterrupted&) {
    // There is no result.
  }
  return nb::make_tuple(interrupted(), nb::none());
}

struct Evaluated {
  Evaluation evaluation;
  std::pair<double, double> interval;
};

nb::dict dict_of(const Evaluated& evaluated) {
  const Evaluation& evaluation = evaluated.evaluation;
  nb::dict result;
  result["returns"] = copy_array<double>(evaluation.returns.data(), {evaluation.returns.size()});
  result["lengths"] =
      copy_array<std::int64_t>(evaluation.lengths.data(), {evaluation.lengths.size()});
  result["diverged"] = evaluation.diverged;
  result["mean_return"] = evaluation.mean_return();
  result["standard_error"] = evaluation.standard_error();
  result["confidence_interval_95"] = evaluated.interval;
  return result;
}

nb::tuple evaluate_policy(const nb::object& policy, Index episodes, std::uint64_t seed,
                          bool stochastic, int threads, const nb::object& source) {
  const SavedPolicy& saved = saved_policy(policy);
  const auto evaluated = [&](bool stops_on_signals) {
    ThreadPool pool(threads);
    Evaluation evaluation = evaluate(saved, episodes, seed, stochastic, pool, stops_on_signals);
    const auto interval = bootstrap_interval(evaluation.returns, seed);
    return Evaluated{std::move(evaluation), interval};
  };
  return until_a_signal(source, evaluated, dict_of);
}

nb::tuple record_policy(const nb::object& policy, Index episodes, std::uint64_t seed,
                        bool stochastic, int threads, const nb::object& source) {
  const SavedPolicy& saved = saved_policy(policy);
  const auto recorded = [&](bool stops_on_signals) {
    ThreadPool pool(threads);
    return record(saved, episodes, seed, stochastic, pool, stops_on_signals);
  };
  return until_a_signal(source, recorded,
                        [](Demonstrations demos) { return nb::cast(std::move(demos)); });
}

int run_command_line(const std::vector<std::string>& words, const nb::object& source) {
  PythonSource environments(source);
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const OutsidePython outside(environments);
  return command_line(static_cast<int>(copies.size()), arguments.data());
}

}  // namespace

void bind_training(nb::module_& module) {
  module.def("methods", &training_methods);
  module.def("progress_columns", &progress_columns);
  module.def("batch_steps", &batch_steps, nb::arg("environment"), nb::arg("preset"),
             nb::arg("assignments"), "The setting run.batch_steps that these come to.");
  module.def("train", &train, nb::arg("environment"), nb::arg("method"),
             nb::arg("demonstrations").none(), nb::arg("out"), nb::arg("preset"),
             nb::arg("assignments"), nb::arg("timesteps"), nb::arg("lanes"), nb::arg("seed"),
             nb::arg("threads"), nb::arg("resume"), nb::arg("progress"), nb::arg("callback").none(),
             nb::arg("source"));
  module.def("evaluate", &evaluate_policy, nb::arg("policy"), nb::arg("episodes"), nb::arg("seed"),
             nb::arg("stochastic"), nb::arg("threads"), nb::arg("source"));
  module.def("record", &record_policy, nb::arg("policy"), nb::arg("episodes"), nb::arg("seed"),
             nb::arg("stochastic"), nb::arg("threads"), nb::arg("source"));
  module.def("command_line", &run_command_line, nb::arg("words"), nb::arg("source"),
             "The program agail, in this process: its exit code.");
}

}  // namespace agail
