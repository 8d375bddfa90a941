// Files that are either whole or absent, whatever happens while they are written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace agail {

// Temporary name in the same folder, fsync, rename, fsync of the folder: after a crash at any
// moment `path` holds the old content or the new one. SystemError (path, reason) if the machine
// fails; InputError if `path` is a folder.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);
// The same for what writes into a file by its name: `fill` makes a file of the temporary name.
void write_file_atomically(const std::filesystem::path& path,
                           const std::function<void(const std::filesystem::path&)>& fill);

// The same, unless something is there already: of several who do this at once one alone gets true.
bool create_file_atomically(const std::filesystem::path& path, std::string_view text);

// What may become `path` once it is whole: in the same folder, a name that nobody else uses, begins
// with a dot, ends in .tmp and is not too long, however long that of `path` is.
std::filesystem::path temporary_name(const std::filesystem::path& path);

// What was written to the file is on the disk, and outlasts a power cut, when this returns.
void sync_file(const std::filesystem::path& path);

// Creates a folder that the user named (and its parents) and makes sure that files can be created
// in it: InputError if not. For an output file, pass its parent; an empty path is the current
// folder.
void create_output_folder(const std::filesystem::path& folder);
// The same InputError, as far as it can be told without creating anything.
void check_output_folder(const std::filesystem::path& folder);

// InputError if it cannot be told: no permission, a name that is too long.
bool is_there(const std::filesystem::path& path);

// InputError if the file cannot be opened or is larger than `max_bytes`; SystemError if reading
// fails.
std::vector<std::uint8_t> read_file(const std::filesystem::path& path,
                                    std::size_t max_bytes = std::size_t{1} << 32);

}  // namespace agail
