// "Did you mean ...?"
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace agail {

// The candidate with the smallest edit distance to `name` (letter case ignored; the first of
// equals), or "" if there is no candidate.
std::string nearest(std::string_view name, std::span<const std::string> candidates);

}  // namespace agail
