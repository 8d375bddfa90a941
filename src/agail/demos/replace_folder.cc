#include "agail/demos/replace_folder.h"

#include <fcntl.h>
#include <stdio.h>  // NOLINT(modernize-deprecated-headers): renameat2
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <set>
#include <string>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

// A trailing slash would make the folder its own parent.
fs::path without_slash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

void sync(const fs::path& folder) {
  const int handle =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return;
  ::fsync(handle);
  ::close(handle);
}

void put_in_place(const fs::path& made, const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) {
    if (::rename(made.c_str(), folder.c_str()) == 0) return;
  } else if (::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) == 0) {
    fs::remove_all(made);  // the old one, now
    return;
  } else if (errno == EINVAL || errno == ENOSYS) {
    const fs::path old = made.string() + ".old";
    if (::rename(folder.c_str(), old.c_str()) == 0 && ::rename(made.c_str(), folder.c_str()) == 0) {
      fs::remove_all(old);
      return;
    }
  }
  throw SystemError("cannot put " + folder.string() + " in place: " + std::strerror(errno));
}

bool holds_nothing_but(const std::set<fs::path>& names, const fs::path& folder) {
  std::error_code error;
  std::set<fs::path> there;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    there.insert(entry.path().filename());
  return !error && there == names;
}

}  // namespace

void check_replaceable_dataset(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  if (!fs::is_directory(folder, error))
    throw InputError(folder.string() +
                     " is a file; end the name in .hdf5 for one file, or give a new folder");
  if (fs::is_empty(folder, error)) return;
  // Whatever else lies there is somebody's.
  if (!holds_nothing_but({"data"}, folder) ||
      !holds_nothing_but({"main_data.hdf5", "metadata.json"}, folder / "data"))
    throw InputError(
        folder.string() +
        " is a folder, and no Minari dataset that could be replaced; give another name");
}

void replace_folder(const fs::path& target, const std::function<void(const fs::path&)>& fill) {
  const fs::path folder = without_slash(target);
  create_output_folder(folder.parent_path());
  // A leading dot: Minari does not list it.
  const fs::path made = folder.parent_path() / ("." + folder.filename().string() + "." +
                                                std::to_string(::getpid()) + ".tmp");
  try {
    fs::remove_all(made);
    fs::create_directory(made);
    fill(made);
    sync(made);
    put_in_place(made, folder);
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(made, ignored);
    throw;
  }
  sync(folder.parent_path());
}

}  // namespace agail
