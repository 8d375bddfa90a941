#include "agail/train/checkpoint.h"

#include <algorithm>

#include "agail/base/atomic_file.h"
#include "agail/base/build_info.h"
#include "agail/base/crc32c.h"
#include "agail/comm/collectives.h"
#include "agail/comm/together.h"
#include "agail/config/resolve.h"
#include "agail/train/safetensors.h"

namespace agail {

namespace {

constexpr const char* kFormat = "agail-checkpoint-2";

std::map<std::string, std::string> identity(const Trainer& trainer) {
  const TrainingTask& task = trainer.task();
  // A run may be made longer, and saved more or less often, without becoming another.
  Settings settings = task.settings;
  settings.run.timesteps = 1;
  settings.run.checkpoint_every = 1;
  std::map<std::string, std::string> result = {{"format", kFormat},
                                               {"environment", task.environment},
                                               {"method", task.method},
                                               {"seed", std::to_string(task.seed)},
                                               {"settings", to_toml(settings)},
                                               {"demonstrations", "none"}};
  // Parameters of a policy that learns in units of its own mean nothing in the environment's.
  const ActionSpace& action = environment_spec(task.environment).action;
  if (ActionUnits(action).space() != action) result["action_units"] = "bounds";
  if (trainer.demonstrations())
    result["demonstrations"] = "crc32c:" + std::to_string(trainer.demonstrations()->fingerprint);
  return result;
}

void walk(Archive& archive, const char* name, std::optional<Evaluation>& evaluation) {
  Evaluation value = evaluation.value_or(Evaluation{});  // without episodes: none
  archive.scope(name, [&](Archive& inner) {
    inner.resizable("returns", value.returns);
    inner.resizable("lengths", value.lengths);
    inner("diverged", value.diverged);
  });
  evaluation = value.returns.empty() ? std::nullopt : std::optional(std::move(value));
}

void walk(Archive& archive, Trainer& trainer, RunEvaluations& evaluations) {
  walk(archive, "best_evaluation", evaluations.best);
  walk(archive, "last_evaluation", evaluations.last);
  archive.scope("trainer", [&](Archive& inner) { trainer.archive(inner); });
}

}  // namespace

CheckpointFile::CheckpointFile(const std::filesystem::path& folder, const Trainer& trainer)
    : file_(path(folder)), identity_(identity(trainer)) {}

std::uint32_t CheckpointFile::fingerprint() const {
  std::string text = std::string(kVersion) + " " + cpu_features();
  for (const auto& [key, value] : identity_) text += "\n" + key + " " + value;
  return crc32c(std::vector<std::uint8_t>(text.begin(), text.end()));
}

void CheckpointFile::save(Trainer& trainer, RunEvaluations& evaluations) const {
  TensorStore store;
  store.metadata = identity_;
  Archive archive(store, Archive::Mode::kSave);
  walk(archive, trainer, evaluations);
  Communicator& communicator = trainer.team().communicator();
  const std::vector<std::uint8_t> bytes = to_safetensors(store);
  // The safety net of a state that is held by all: a machine that computes otherwise ends the job
  // before its result is written.
  if (const int other = first_that_differs(communicator, crc32c(bytes)); other >= 0)
    throw SystemError("the state of " + communicator.name(other) +
                      " is no longer that of rank 0; its machine or build computes differently");
  if (communicator.rank() == 0) write_file_atomically(file_, bytes);
}

bool CheckpointFile::load(Trainer& trainer, RunEvaluations& evaluations) const {
  Communicator& communicator = trainer.team().communicator();
  std::vector<std::uint8_t> bytes;  // none: no checkpoint
  together(communicator, [&] {
    if (communicator.rank() != 0 || !std::filesystem::exists(file_)) return;
    bytes = read_file(file_);
    if (bytes.empty())
      throw InputError(file_.string() + ": the checkpoint is empty; start a new run");
  });
  if (communicator.ranks() > 1) {
    const auto view = std::as_bytes(std::span(bytes));
    Bytes message(view.begin(), view.end());
    broadcast(communicator, message);
    bytes.resize(message.size());
    std::ranges::copy(message, std::as_writable_bytes(std::span(bytes)).begin());
  }
  if (bytes.empty()) return false;
  together(communicator, [&] { restore(bytes, trainer, evaluations); });
  return true;
}

void CheckpointFile::restore(const std::vector<std::uint8_t>& bytes, Trainer& trainer,
                             RunEvaluations& evaluations) const {
  TensorStore store = from_safetensors(bytes, file_.string(), Checksum::kRequired);
  for (const auto& [key, value] : identity_) {
    const auto found = store.metadata.find(key);
    if (found == store.metadata.end() || found->second != value)
      throw InputError(
          file_.string() + ": the checkpoint was made with other " + key +
          "; resume with what the run was started with, or start a new run in another folder");
  }
  Archive archive(store, Archive::Mode::kLoad);
  walk(archive, trainer, evaluations);
}

}  // namespace agail
