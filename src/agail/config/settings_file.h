// Settings as users write them: TOML files and key=value.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "agail/config/setting.h"

namespace agail {

struct Assignment {
  const Setting* setting;
  SettingValue value;  // checked
};

// [trpo] max_kl = 0.01                      -> general
// [environment."Hopper-v4".trpo] ...        -> environments, by exact id or by family ("Hopper")
// preset = "paper"                          -> base: the preset that this file changes
struct SettingsFile {
  std::string base;
  std::vector<Assignment> general;
  std::vector<std::pair<std::string, std::vector<Assignment>>> environments;

  // General values, then the family's, then the exact id's.
  void apply(Settings& settings, std::string_view environment) const;
};

// Everything in the text is checked, also what is for other environments. `where`: the file's name.
// InputError, one line with file and line, for bad TOML, unknown keys (with the nearest name) and
// bad values.
SettingsFile parse_settings(std::string_view text, const std::string& where);

// "trpo.max_kl=0.02": a value as in TOML; texts also without quotes. InputError.
Assignment parse_assignment(std::string_view text);

// "Hopper-v4" -> "Hopper"; an id without a version is its own family.
std::string_view environment_family(std::string_view id);

}  // namespace agail
