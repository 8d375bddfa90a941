// A TOML value -> the checked value of a setting.
#pragma once

#include <toml++/toml.h>

#include <string>

#include "agail/config/setting.h"

namespace agail {

// InputError "<where>: <name> = <value> ...; give <what is expected>" if it has the wrong type or
// is out of range. A whole number does for a number, and 1e6 for a whole number.
SettingValue parse_value(const Setting& setting, const toml::node& node, const std::string& where);

}  // namespace agail
