#include "agail/config/parse_value.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "agail/base/error.h"

namespace agail {
namespace {

// Doubles hold all whole numbers up to here.
constexpr double kExact = 9007199254740992.0;

bool read(const toml::node& node, std::int64_t& out) {
  if (const auto* value = node.as_integer()) {
    out = value->get();
    return true;
  }
  const auto* value = node.as_floating_point();
  if (value == nullptr || !(std::abs(value->get()) <= kExact)) return false;
  out = static_cast<std::int64_t>(value->get());
  return static_cast<double>(out) == value->get();
}

bool read(const toml::node& node, double& out) {
  if (const auto* value = node.as_floating_point())
    out = value->get();
  else if (const auto* whole = node.as_integer())
    out = static_cast<double>(whole->get());
  else
    return false;
  return true;
}

bool read(const toml::node& node, bool& out) {
  if (!node.is_boolean()) return false;
  out = node.as_boolean()->get();
  return true;
}

bool read(const toml::node& node, std::string& out) {
  if (!node.is_string()) return false;
  out = node.as_string()->get();
  return true;
}

bool read(const toml::node& node, Sizes& out) {
  const toml::array* array = node.as_array();
  if (array == nullptr) return false;
  return std::all_of(array->begin(), array->end(),
                     [&](const toml::node& entry) { return read(entry, out.emplace_back()); });
}

bool read(const toml::node& node, std::optional<double>& out) {
  if (node.is_string() && node.as_string()->get() == "auto") return true;
  return read(node, out.emplace());
}

// As it would stand in a file, in one line that is not too long.
std::string shown(const toml::node& node) {
  std::ostringstream stream;
  stream << toml::node_view<const toml::node>(node);
  const std::string text = one_line(stream.str());
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

}  // namespace

SettingValue parse_value(const Setting& setting, const toml::node& node, const std::string& where) {
  const auto refuse = [&](const std::string& what) {
    return InputError(where + ": " + setting.name + " = " + shown(node) + " " + what + "; give " +
                      setting.expectation());
  };
  return std::visit(
      [&]<class T>(FieldOf<T>) {
        T value{};
        if (!read(node, value)) throw refuse("has the wrong type");
        SettingValue result(value);
        if (!setting.allows(result)) throw refuse("is not allowed");
        return result;
      },
      setting.field);
}

}  // namespace agail
