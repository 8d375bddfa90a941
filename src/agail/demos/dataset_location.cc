#include "agail/demos/dataset_location.h"

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

// Whether Minari takes `text` for the id of a dataset.
bool is_id(const std::string& text) {
  static const std::regex form(R"(([-\w][-\w/]*[-\w]/)?[-\w]+-v\d{1,9})");
  // Longer ones could exhaust the stack, of which std::regex takes some for each character.
  return text.size() < 1000 && std::regex_match(text, form);
}

// The folder of main_data.hdf5: Minari's dataset folder has it in data/, but people pass data/
// itself, too.
bool locate_in_folder(const fs::path& folder, DatasetLocation& location) {
  for (const fs::path& data : {folder / "data", folder}) {
    std::error_code error;
    if (is_there(data / "main_data.hdf5") && fs::is_regular_file(data / "main_data.hdf5", error)) {
      location.data = (data / "main_data.hdf5").string();
      const bool described = fs::is_regular_file(data / "metadata.json", error);
      location.metadata = described ? (data / "metadata.json").string() : "";
      return true;
    }
    if (fs::is_regular_file(data / "metadata.json", error))
      throw InputError(folder.string() +
                       " is a Minari dataset without main_data.hdf5; it is incomplete or in "
                       "another format, which "
                       "Minari converts to hdf5");
  }
  return false;
}

// Absolute, and without a slash at the end, which would be a name of its own.
fs::path plain(const fs::path& folder) {
  std::error_code error;
  const fs::path path = fs::weakly_canonical(fs::absolute(folder), error);
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

std::string minari_root() {
  const char* root = std::getenv("MINARI_DATASETS_PATH");
  if (root != nullptr && *root != '\0') return root;
  const char* home = std::getenv("HOME");
  return ((home == nullptr ? fs::path(".") : fs::path(home)) / ".minari" / "datasets").string();
}

bool is_single_file(const std::string& path) { return fs::path(path).extension() == ".hdf5"; }

DatasetLocation locate_dataset(const std::string& path_or_id) {
  DatasetLocation location;
  std::error_code error;
  const fs::path path(path_or_id);
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) {
    if (locate_in_folder(path, location)) return location;
  } else if (fs::exists(status)) {
    location.data = path_or_id;
    return location;
  }
  if (is_id(path_or_id)) {
    if (locate_in_folder(fs::path(minari_root()) / path, location)) return location;
    if (status.type() == fs::file_type::not_found)
      throw InputError(path_or_id + " is neither here nor among Minari's datasets in " +
                       minari_root() + "; `minari download " + path_or_id +
                       "` fetches published ones");
  }
  if (fs::is_directory(status))
    throw InputError(path_or_id + " is a folder without data/main_data.hdf5, so no Minari dataset");
  if (!fs::status_known(status))
    throw InputError("cannot open " + path_or_id + ": " + error.message());
  throw InputError(
      path_or_id +
      " does not exist; give a .hdf5 file, a Minari dataset folder or a Minari dataset id");
}

std::string dataset_id_for(const std::string& folder) {
  const fs::path here = plain(folder);
  const fs::path root = plain(minari_root());
  std::string below = here.lexically_relative(root).generic_string();
  if (!below.empty() && below != "." && !below.starts_with("..")) {
    if (!is_id(below))
      throw InputError(folder +
                       " lies among Minari's datasets, where names end in a version; call it " +
                       folder + "-v0");
    return below;
  }
  std::string name = here.filename().string();
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '-';
  if (name.empty()) name = "demonstrations";
  return is_id(name) ? name : name + "-v0";
}

}  // namespace agail
