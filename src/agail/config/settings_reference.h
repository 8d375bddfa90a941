// Texts for users, made from the table of settings and the presets.
#pragma once

#include <string>

namespace agail {

std::string settings_help();      // for a terminal: a few lines a setting
std::string settings_markdown();  // the reference page: presets side by side

}  // namespace agail
