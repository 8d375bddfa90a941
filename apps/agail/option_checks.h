// Checks that several sub-commands make of their options.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>

namespace agail {

// A whole number in this range, in plain decimals. CLI11 alone would read 010 as 8, and a number
// that is too large as the largest one.
CLI::Validator whole_number(std::uint64_t low, std::uint64_t high);

inline CLI::Validator positive() {
  return whole_number(1, std::numeric_limits<std::int64_t>::max());
}
inline CLI::Validator any_seed() {
  return whole_number(0, std::numeric_limits<std::uint64_t>::max());
}

// Not the empty text, which as a path would be the current folder.
CLI::Validator not_empty();

}  // namespace agail
