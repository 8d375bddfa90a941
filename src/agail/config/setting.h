// One setting's description, from which come the TOML key, --set, the help and the reference page.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "agail/config/settings.h"

namespace agail {

using Sizes = std::vector<std::int64_t>;

// Whole number, number, switch, choice, list of whole numbers, number or "auto" (none).
using SettingValue =
    std::variant<std::int64_t, double, bool, std::string, Sizes, std::optional<double>>;

// Where the value is in a Settings; the alternatives in the order of SettingValue's.
template <class T>
using FieldOf = T& (*)(Settings&);
using SettingField =
    std::variant<FieldOf<std::int64_t>, FieldOf<double>, FieldOf<bool>, FieldOf<std::string>,
                 FieldOf<Sizes>, FieldOf<std::optional<double>>>;

// The values that make sense: a range for numbers (and each entry of a list), names for a choice.
struct Allowed {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;   // low itself is not allowed
  bool below_high = false;  // high itself is not allowed
  std::vector<std::string> choices{};
};

struct Setting {
  std::string name;  // "trpo.max_kl"
  SettingField field;
  Allowed allowed;
  std::string unit;  // "" for plain numbers
  std::string help;  // a clause without a full stop

  SettingValue get(const Settings& settings) const;
  void set(Settings& settings, const SettingValue& value) const;  // same type as the field
  bool allows(const SettingValue& value) const;                   // same type as the field
  std::string expectation() const;                                // "a number above 0 (nats)"
  std::string range() const;  // "above 0", "" if all values are allowed
};

std::span<const Setting> settings_table();           // in the order of the reference page
const Setting* find_setting(std::string_view name);  // nullptr if there is none
std::string to_toml(const SettingValue& value);      // reads back as the same value

}  // namespace agail
