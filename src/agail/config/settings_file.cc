#include "agail/config/settings_file.h"

#include <toml++/toml.h>

#include "agail/base/error.h"
#include "agail/base/nearest.h"
#include "agail/config/parse_value.h"

namespace agail {
namespace {

std::string at_line(const std::string& where, const toml::source_region& source) {
  return where + ":" + std::to_string(source.begin.line);
}

bool is_section(const std::string& name) {
  for (const Setting& setting : settings_table())
    if (setting.name.starts_with(name + ".")) return true;
  return false;
}

InputError unknown(const std::string& where, const std::string& name, bool section) {
  std::vector<std::string> candidates;
  for (const Setting& setting : settings_table())
    candidates.push_back(section ? setting.name.substr(0, setting.name.find('.')) : setting.name);
  return InputError(where + ": unknown " + (section ? "section" : "setting") + " '" + name +
                    "'; did you mean " + nearest(name, candidates) + "?");
}

void collect(const toml::table& table, const std::string& prefix, const std::string& where,
             std::vector<Assignment>& out) {
  for (const auto& [key, node] : table) {
    const std::string name = prefix + std::string(key.str());
    const std::string line = at_line(where, key.source());
    if (const Setting* setting = find_setting(name))
      out.push_back({setting, parse_value(*setting, node, line)});
    else if (node.is_table() && is_section(name))
      collect(*node.as_table(), name + ".", where, out);
    else
      throw unknown(line, name, node.is_table() && prefix.empty());
  }
}

const toml::table& as_table(const toml::node& node, const std::string& line,
                            const std::string& name) {
  if (!node.is_table())
    throw InputError(line + ": " + name + " is not a table; write [environment.\"Hopper-v4\"]");
  return *node.as_table();
}

toml::table parse_toml(std::string_view text, const std::string& where) {
  try {
    return toml::parse(text, where);
  } catch (const toml::parse_error& error) {
    throw InputError(at_line(where, error.source()) +
                     ": not TOML: " + std::string(error.description()));
  }
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

}  // namespace

std::string_view environment_family(std::string_view id) {
  const auto version = id.rfind("-v");
  const bool numbered = version != std::string_view::npos && version + 2 < id.size() &&
                        id.find_first_not_of("0123456789", version + 2) == std::string_view::npos;
  return numbered ? id.substr(0, version) : id;
}

void SettingsFile::apply(Settings& settings, std::string_view environment) const {
  const auto assign = [&](const std::vector<Assignment>& assignments) {
    for (const Assignment& a : assignments) a.setting->set(settings, a.value);
  };
  assign(general);
  const std::string_view family = environment_family(environment);
  if (family != environment)
    for (const auto& [name, assignments] : environments)
      if (name == family) assign(assignments);
  for (const auto& [name, assignments] : environments)
    if (name == environment) assign(assignments);
}

SettingsFile parse_settings(std::string_view text, const std::string& where) {
  toml::table table = parse_toml(text, where);
  SettingsFile file;
  if (const toml::node* base = table.get("preset")) {
    if (!base->is_string())
      throw InputError(at_line(where, base->source()) +
                       ": preset is not a text; write preset = \"default\"");
    file.base = base->as_string()->get();
  }
  if (const toml::node* node = table.get("environment")) {
    const std::string line = at_line(where, node->source());
    for (const auto& [id, changes] : as_table(*node, line, "environment")) {
      const std::string name(id.str());
      auto& [ignored, assignments] =
          file.environments.emplace_back(name, std::vector<Assignment>());
      collect(as_table(changes, at_line(where, id.source()), "environment." + name), "", where,
              assignments);
    }
  }
  table.erase("preset");
  table.erase("environment");
  collect(table, "", where, file.general);
  return file;
}

Assignment parse_assignment(std::string_view text) {
  const std::string where = "--set " + std::string(text);
  const auto equals = text.find('=');
  if (equals == std::string_view::npos)
    throw InputError(where + ": no '='; write --set key=value, for example trpo.max_kl=0.02");
  const std::string name(trimmed(text.substr(0, equals)));
  const std::string value(trimmed(text.substr(equals + 1)));
  const Setting* setting = find_setting(name);
  if (setting == nullptr) throw unknown(where, name, false);
  toml::table parsed;
  try {
    parsed = toml::parse("value = " + value);
  } catch (const toml::parse_error&) {
    parsed.clear();
  }
  if (parsed.size() != 1) {  // a text without quotes
    parsed.clear();
    parsed.insert("value", value);
  }
  return {setting, parse_value(*setting, *parsed.get("value"), "--set")};
}

}  // namespace agail
