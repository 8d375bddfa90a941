// Exceptions of the user's Python code (environments, callbacks) on their way through C++.
#pragma once

#include <nanobind/nanobind.h>

#include <memory>
#include <string>

#include "agail/base/error.h"

namespace agail {

// To the core it is wrong input, with the exception's text as its message; in Python it becomes the
// exception again, traceback and cause included.
class PythonFailure : public InputError {
 public:
  // With the GIL held.
  explicit PythonFailure(const nanobind::python_error& error);
  // Sets Python's error indicator; with the GIL held.
  void restore() const;

 private:
  std::shared_ptr<PyObject> exception_;
};

}  // namespace agail
