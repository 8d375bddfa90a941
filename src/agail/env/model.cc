#include "agail/env/model.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "agail/base/error.h"

namespace agail {
namespace {

thread_local int quiet_depth = 0;
mjfLogHandler previous_handler = nullptr;

void handle_log(const mjLogMessage* message) {
  if (quiet_depth == 0) {
    if (previous_handler != nullptr) previous_handler(message);
    return;
  }
  // Warnings are counted in mjData, where do_step looks for them. An error must not return to
  // MuJoCo.
  if (message->level == mjLOG_ERROR) throw SystemError(std::string("MuJoCo: ") + message->subject);
}

std::shared_ptr<const mjModel> compile(const std::string& name) {
  const auto file = std::ranges::find(model_files(), name + ".xml", &EmbeddedFile::name);
  AGAIL_CHECK(file != model_files().end());
  const QuietMuJoCo quiet;
  char error[1024] = "";
  const std::unique_ptr<mjSpec, decltype(&mj_deleteSpec)> spec(
      mj_parseXMLString(std::string(file->text).c_str(), nullptr, error, sizeof error),
      mj_deleteSpec);
  mjModel* model = spec ? mj_compile(spec.get(), nullptr) : nullptr;
  if (model == nullptr)
    throw SystemError("model " + name + ": " + (spec ? mjs_getError(spec.get()) : error));
  model->opt.disableflags |= mjDSBL_AUTORESET;
  return std::shared_ptr<const mjModel>(
      model, [](const mjModel* m) { mj_deleteModel(const_cast<mjModel*>(m)); });
}

}  // namespace

QuietMuJoCo::QuietMuJoCo() {
  static std::once_flag once;
  std::call_once(once, [] { previous_handler = mju_setLogHandler(handle_log); });
  ++quiet_depth;
}

QuietMuJoCo::~QuietMuJoCo() { --quiet_depth; }

std::shared_ptr<const mjModel> load_model(const std::string& name) {
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<const mjModel>> models;
  const std::lock_guard lock(mutex);
  auto& model = models[name];
  if (!model) model = compile(name);
  return model;
}

}  // namespace agail
