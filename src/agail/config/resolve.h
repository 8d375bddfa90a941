// From what the user gave to the values of a run.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "agail/base/embedded_file.h"
#include "agail/config/settings.h"

namespace agail {

struct SettingsSource {
  std::string preset = "default";  // name of a preset, or path of a TOML file (ends with .toml)
  std::string environment;         // id: chooses tables [environment."..."]
  std::vector<std::string> assignments;  // "key=value", from --set
};

// Later wins: the preset (a file's base: its `preset`, else "default"), the preset's tables for the
// environment, the user's file, its tables for the environment, assignments in their order.
// InputError.
Settings resolve_settings(const SettingsSource& source);

// All values as TOML, equal settings to equal bytes; as a preset it gives the same settings again.
std::string to_toml(const Settings& settings);

// presets/*.toml, compiled in. default.toml is the first.
std::span<const EmbeddedFile> preset_files();

}  // namespace agail
