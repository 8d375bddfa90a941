#include "agail/config/settings_reference.h"

#include "agail/config/resolve.h"
#include "agail/config/settings_file.h"

namespace agail {
namespace {

struct Preset {
  std::string name;
  SettingsFile file;
  Settings settings;  // without an environment's tables
};

std::vector<Preset> all_presets() {
  std::vector<Preset> presets;
  for (const EmbeddedFile& embedded : preset_files()) {
    Preset& preset = presets.emplace_back();
    preset.name = embedded.name.substr(0, embedded.name.size() - 5);
    preset.file = parse_settings(embedded.text, "preset " + preset.name);
    preset.file.apply(preset.settings, "");
  }
  return presets;
}

std::string section_of(const Setting& setting) {
  return setting.name.substr(0, setting.name.find('.'));
}

std::string code(const std::string& text) { return "`" + text + "`"; }

std::string row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (std::string cell : cells) {
    for (std::size_t at = 0; (at = cell.find('|', at)) != std::string::npos; at += 2)
      cell.insert(at, "\\");
    line += " " + cell + " |";
  }
  return line + "\n";
}

}  // namespace

std::string settings_help() {
  const std::vector<Preset> presets = all_presets();
  std::string text;
  for (const Setting& setting : settings_table()) {
    text += setting.name + "\n    " + setting.help + "\n    " + setting.expectation() + "; ";
    for (const Preset& preset : presets)
      text += (&preset == presets.data() ? "" : ", ") + preset.name + ": " +
              to_toml(setting.get(preset.settings));
    text += "\n";
  }
  return text;
}

std::string settings_markdown() {
  const std::vector<Preset> presets = all_presets();
  std::vector<std::string> head = {"setting"}, rule = {"---"};
  for (const Preset& preset : presets) head.push_back(preset.name);
  for (const char* title : {"unit", "allowed", "what it does"}) head.emplace_back(title);
  rule.resize(head.size(), "---");

  std::string text =
      "# Settings\n\nMade from src/agail/config/settings_table.cc and presets/; do not edit.\n\n"
      "A setting is given in a TOML file (`--preset FILE.toml`) or as `--set key=value`.\n";
  std::string section;
  for (const Setting& setting : settings_table()) {
    if (section_of(setting) != section) {
      section = section_of(setting);
      text += "\n## " + section + "\n\n" + row(head) + row(rule);
    }
    std::vector<std::string> cells = {code(setting.name)};
    for (const Preset& preset : presets)
      cells.push_back(code(to_toml(setting.get(preset.settings))));
    cells.insert(cells.end(), {setting.unit, setting.range(), setting.help});
    text += row(cells);
  }

  text += "\n## Values for single environments\n\n" +
          row({"preset", "environment", "setting", "value"}) + row({"---", "---", "---", "---"});
  for (const Preset& preset : presets)
    for (const auto& [environment, assignments] : preset.file.environments)
      for (const Assignment& assignment : assignments)
        text += row({preset.name, code(environment), code(assignment.setting->name),
                     code(to_toml(assignment.value))});
  return text;
}

}  // namespace agail
