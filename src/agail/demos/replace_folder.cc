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

// A file there is somebody's. False if nothing is there.
bool is_folder(const fs::path& path) {
  if (!is_there(path)) return false;
  std::error_code error;
  if (fs::is_directory(path, error)) return true;
  throw InputError(path.string() +
                   " is a file; end the name in .hdf5 for one file, or give a new folder");
}

void put_in_place(const fs::path& made, const fs::path& folder) {
  if (!is_folder(folder)) {
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

void check_replaceable_dataset(const fs::path& target) {
  const fs::path folder = without_slash(target);  // "file/" is not there, but "file" is
  check_output_folder(folder.parent_path());
  std::error_code error;
  if (!is_folder(folder) || fs::is_empty(folder, error)) return;
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
  const fs::path made = temporary_name(folder);  // begins with a dot: Minari does not list it
  try {
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
