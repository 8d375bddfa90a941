#include "agail/config/resolve.h"

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/base/nearest.h"
#include "agail/config/settings_file.h"

namespace agail {
namespace {

constexpr std::size_t kMaxFile = 1 << 20;

SettingsFile built_in(const std::string& name, const std::string& where) {
  std::vector<std::string> names;
  for (const EmbeddedFile& file : preset_files()) {
    if (file.name == name + ".toml") return parse_settings(file.text, "preset " + name);
    names.emplace_back(file.name.substr(0, file.name.size() - 5));
  }
  throw InputError(where + ": unknown preset '" + name + "'; did you mean " + nearest(name, names) +
                   "? (a file's name ends with .toml)");
}

}  // namespace

Settings resolve_settings(const SettingsSource& source) {
  Settings settings;
  if (source.preset.ends_with(".toml")) {
    const std::vector<std::uint8_t> bytes = read_file(source.preset, kMaxFile);
    const SettingsFile file =
        parse_settings(std::string(bytes.begin(), bytes.end()), source.preset);
    built_in(file.base.empty() ? "default" : file.base, source.preset)
        .apply(settings, source.environment);
    file.apply(settings, source.environment);
  } else {
    built_in(source.preset, "--preset").apply(settings, source.environment);
  }
  for (const std::string& text : source.assignments) {
    const Assignment assignment = parse_assignment(text);
    assignment.setting->set(settings, assignment.value);
  }
  return settings;
}

std::string to_toml(const Settings& settings) {
  std::string text, section;
  for (const Setting& setting : settings_table()) {
    const auto dot = setting.name.find('.');
    if (setting.name.substr(0, dot) != section) {
      text += text.empty() ? "" : "\n";
      section = setting.name.substr(0, dot);
      text += "[" + section + "]\n";
    }
    text += setting.name.substr(dot + 1) + " = " + to_toml(setting.get(settings)) + "\n";
  }
  return text;
}

}  // namespace agail
