#include "agail/config/setting.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "agail/base/error.h"

namespace agail {
namespace {

template <class T>
std::string shortest(T value) {
  std::array<char, 32> text;
  return std::string(text.begin(), std::to_chars(text.begin(), text.end(), value).ptr);
}

std::string text_of(std::int64_t value) { return shortest(value); }

std::string text_of(double value) {
  const std::string text = shortest(value);
  // Without a point or an exponent TOML would take it for a whole number.
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string text_of(bool value) { return value ? "true" : "false"; }

std::string text_of(const std::string& value) { return '"' + value + '"'; }

std::string text_of(const Sizes& values) {
  std::string text = "[";
  for (const std::int64_t& value : values)
    text += (&value == values.data() ? "" : ", ") + shortest(value);
  return text + "]";
}

std::string text_of(const std::optional<double>& value) {
  return value ? text_of(*value) : "\"auto\"";
}

bool in_range(const Allowed& allowed, double value) {
  if (!std::isfinite(value)) return false;
  const bool low_ok = allowed.above_low ? value > allowed.low : value >= allowed.low;
  const bool high_ok = allowed.below_high ? value < allowed.high : value <= allowed.high;
  return low_ok && high_ok;
}

bool check(const Allowed& allowed, std::int64_t value) {
  return in_range(allowed, static_cast<double>(value));
}
bool check(const Allowed& allowed, double value) { return in_range(allowed, value); }
bool check(const Allowed&, bool) { return true; }
bool check(const Allowed& allowed, const std::string& value) {
  return std::find(allowed.choices.begin(), allowed.choices.end(), value) != allowed.choices.end();
}
bool check(const Allowed& allowed, const Sizes& values) {
  return std::all_of(values.begin(), values.end(),
                     [&](std::int64_t value) { return check(allowed, value); });
}
bool check(const Allowed& allowed, const std::optional<double>& value) {
  return !value || in_range(allowed, *value);
}

std::string kind(const Setting& setting) {
  constexpr std::array<const char*, std::variant_size_v<SettingField>> kinds = {
      "a whole number",      "a number", "", "", "a list of whole numbers like [100, 100]",
      "\"auto\" or a number"};
  return kinds[setting.field.index()];
}

}  // namespace

SettingValue Setting::get(const Settings& settings) const {
  // The accessors serve reading and writing; this one only reads.
  auto& readable = const_cast<Settings&>(settings);
  return std::visit([&](auto access) { return SettingValue(access(readable)); }, field);
}

void Setting::set(Settings& settings, const SettingValue& value) const {
  AGAIL_CHECK(value.index() == field.index());
  std::visit(
      [&](auto access) {
        auto& target = access(settings);
        target = std::get<std::remove_reference_t<decltype(target)>>(value);
      },
      field);
}

bool Setting::allows(const SettingValue& value) const {
  AGAIL_CHECK(value.index() == field.index());
  return std::visit([&](const auto& v) { return check(allowed, v); }, value);
}

std::string Setting::range() const {
  if (std::holds_alternative<FieldOf<bool>>(field)) return "true or false";
  if (std::holds_alternative<FieldOf<std::string>>(field)) {
    std::string text;
    for (const std::string& choice : allowed.choices)
      text += (text.empty() ? "" : ", ") + text_of(choice);
    return text;
  }
  const bool low = std::isfinite(allowed.low), high = std::isfinite(allowed.high);
  const std::string low_text = (allowed.above_low ? "above " : "at least ") + shortest(allowed.low);
  const std::string high_text =
      (allowed.below_high ? "below " : "at most ") + shortest(allowed.high);
  if (low && high) return low_text + ", " + high_text;
  return low ? low_text : high ? high_text : "";
}

std::string Setting::expectation() const {
  if (std::holds_alternative<FieldOf<std::string>>(field)) return "one of " + range();
  std::string text = kind(*this);
  if (const std::string limits = range(); !limits.empty()) {
    if (!text.empty()) text += std::holds_alternative<FieldOf<Sizes>>(field) ? ", each " : " ";
    text += limits;
  }
  return unit.empty() ? text : text + " (" + unit + ")";
}

const Setting* find_setting(std::string_view name) {
  for (const Setting& setting : settings_table())
    if (setting.name == name) return &setting;
  return nullptr;
}

std::string to_toml(const SettingValue& value) {
  return std::visit([](const auto& v) { return text_of(v); }, value);
}

}  // namespace agail
