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
  CheckpointFile(const std::filesystem::path& folder, const TrainingTask& task);

  // `best_return`: of the best evaluation so far.
  void save(Trainer& trainer, double& best_return) const;

  // Returns false if there is no checkpoint. InputError if it belongs to another task (environment,
  // method, seed, settings other than run.timesteps and run.checkpoint_every, demonstrations),
  // naming what differs.
  bool load(Trainer& trainer, double& best_return) const;

 private:
  std::filesystem::path file_;
  std::map<std::string, std::string> identity_;
};

}  // namespace agail
