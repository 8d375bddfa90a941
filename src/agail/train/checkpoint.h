// The checkpoint of a run: everything that the next update depends on, in one file that is either
// whole or the last one.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "agail/train/evaluation.h"
#include "agail/train/trainer.h"

namespace agail {

struct RunEvaluations {
  std::optional<Evaluation> best;  // trpo: of policy_best
  std::optional<Evaluation> last;
};

class CheckpointFile {
 public:
  // In `folder`/checkpoints. What identifies the task is taken once, here.
  CheckpointFile(const std::filesystem::path& folder, const Trainer& trainer);

  // Of the task, the version and the machine's instructions: ranks that train together must agree.
  std::uint32_t fingerprint() const;

  static std::filesystem::path path(const std::filesystem::path& folder) {
    return folder / "checkpoints" / "latest.safetensors";
  }

  // For all ranks together; rank 0 writes.
  void save(Trainer& trainer, RunEvaluations& evaluations) const;

  // Returns false if there is no checkpoint. For all ranks together; only rank 0 reads the file,
  // and it may be of a run with another number of ranks. InputError if it belongs to another task
  // (environment, method, seed, settings other than run.timesteps and run.checkpoint_every,
  // demonstrations), naming what differs.
  bool load(Trainer& trainer, RunEvaluations& evaluations) const;

 private:
  void restore(const std::vector<std::uint8_t>& bytes, Trainer& trainer,
               RunEvaluations& evaluations) const;

  std::filesystem::path file_;
  std::map<std::string, std::string> identity_;
};

}  // namespace agail
