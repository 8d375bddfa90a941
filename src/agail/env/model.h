// MuJoCo models that were compiled into the binary, and a quiet MuJoCo.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "agail/base/embedded_file.h"

struct mjModel_;

namespace agail {

// models/*.xml, embedded by CMakeLists.txt.
std::span<const EmbeddedFile> model_files();

// The compiled models/<name>.xml; compiled once a process and shared. MuJoCo's automatic reset of
// bad states is off. An unknown name, or a model that does not compile, is a bug of ours.
std::shared_ptr<const mjModel_> load_model(const std::string& name);

// While one lives, what MuJoCo has to say on this thread is neither printed nor written to a file,
// and its errors are thrown as SystemError instead of ending the process. Other threads, and other
// users of MuJoCo in the process, keep their handler.
class QuietMuJoCo {
 public:
  QuietMuJoCo();
  ~QuietMuJoCo();
  QuietMuJoCo(const QuietMuJoCo&) = delete;
  QuietMuJoCo& operator=(const QuietMuJoCo&) = delete;
};

}  // namespace agail
