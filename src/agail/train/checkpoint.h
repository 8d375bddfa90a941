// The checkpoint of a run: everything that the next update depends on, in one file that is either whole or the last one.
#pragma once

#include <filesystem>
#include <optional>

#include "agail/train/trainer.h"

namespace agail {

std::filesystem::path checkpoint_file(const std::filesystem::path& folder);

// `best_return`: of the best evaluation so far.
void save_checkpoint(const std::filesystem::path& folder, Trainer& trainer, double& best_return);

// Returns false if the folder has no checkpoint. InputError if it belongs to another task (environment, method, seed,
// settings other than run.timesteps, demonstrations), naming what differs.
bool load_checkpoint(const std::filesystem::path& folder, Trainer& trainer, double& best_return);

}  // namespace agail
