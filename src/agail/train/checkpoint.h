// The checkpoint of a run: everything that the next update depends on, in one file that is either
// whole or the last one.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "agail/train/trainer.h"

namespace agail {

class CheckpointFile {
 public:
  // In `folder`/checkpoints. What identifies the task is taken once, here.
  CheckpointFile(const std::filesystem::path& folder, const Trainer& trainer);

  // Of the task, the version and the machine's instructions: ranks that train together must agree.
  std::uint32_t fingerprint() const;

  // `best_return`: of the best evaluation so far. For all ranks together; rank 0 writes.
  void save(Trainer& trainer, double& best_return) const;

  // Returns false if there is no checkpoint. For all ranks together; only rank 0 reads the file,
  // and it may be of a run with another number of ranks. InputError if it belongs to another task
  // (environment, method, seed, settings other than run.timesteps and run.checkpoint_every,
  // demonstrations), naming what differs.
  bool load(Trainer& trainer, double& best_return) const;

 private:
  void restore(const std::vector<std::uint8_t>& bytes, Trainer& trainer, double& best_return) const;

  std::filesystem::path file_;
  std::map<std::string, std::string> identity_;
};

}  // namespace agail
