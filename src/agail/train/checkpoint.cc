#include "agail/train/checkpoint.h"

#include "agail/base/atomic_file.h"
#include "agail/base/crc32c.h"
#include "agail/config/resolve.h"
#include "agail/demos/minari_writer.h"
#include "agail/train/safetensors.h"

namespace agail {

namespace {

constexpr const char* kFormat = "agail-checkpoint-1";

std::map<std::string, std::string> identity(const TrainingTask& task) {
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
  if (task.demonstrations) {
    const std::vector<std::uint8_t> bytes = encode_demonstrations(*task.demonstrations);
    result["demonstrations"] = "crc32c:" + std::to_string(crc32c(bytes));
  }
  return result;
}

void walk(Archive& archive, Trainer& trainer, double& best_return) {
  archive("best_return", best_return);
  archive.scope("trainer", [&](Archive& inner) { trainer.archive(inner); });
}

}  // namespace

CheckpointFile::CheckpointFile(const std::filesystem::path& folder, const TrainingTask& task)
    : file_(folder / "checkpoints" / "latest.safetensors"), identity_(identity(task)) {}

void CheckpointFile::save(Trainer& trainer, double& best_return) const {
  TensorStore store;
  store.metadata = identity_;
  Archive archive(store, Archive::Mode::kSave);
  walk(archive, trainer, best_return);
  write_file_atomically(file_, to_safetensors(store));
}

bool CheckpointFile::load(Trainer& trainer, double& best_return) const {
  if (!std::filesystem::exists(file_)) return false;
  TensorStore store = from_safetensors(read_file(file_), file_.string(), Checksum::kRequired);
  for (const auto& [key, value] : identity_) {
    const auto found = store.metadata.find(key);
    if (found == store.metadata.end() || found->second != value)
      throw InputError(
          file_.string() + ": the checkpoint was made with other " + key +
          "; resume with what the run was started with, or start a new run in another folder");
  }
  Archive archive(store, Archive::Mode::kLoad);
  walk(archive, trainer, best_return);
  return true;
}

}  // namespace agail
