// A dataset folder that is either the old one or the new one.
#pragma once

#include <filesystem>
#include <functional>

namespace agail {

// InputError unless `target`, with a slash at its end or without, lies where one can write and is
// absent, an empty folder, or a Minari dataset and nothing else.
void check_replaceable_dataset(const std::filesystem::path& target);

// `fill` writes into a temporary sibling, which then takes the place of `target` in one step (where
// the file system can exchange two names; elsewhere there is a moment without either). InputError
// if nothing can be created there.
void replace_folder(const std::filesystem::path& target,
                    const std::function<void(const std::filesystem::path&)>& fill);

}  // namespace agail
