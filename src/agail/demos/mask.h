// Removing actions from demonstrations: how the experiments make incomplete demonstrations out of
// complete ones.
//
// eta = missing action entries / all entries. A pattern puts what can be removed into a random
// order that depends on the seed alone, and a ratio takes the front of it; so with one seed a
// larger ratio's mask contains a smaller one's.
//   step       single steps; round(ratio * T) of them in each episode (halves go up)
//   block      runs of 20 steps (the last one cut short); round(ratio * T) steps in each episode
//   episode    whole episodes, in the drawn order, so that their share of all entries is closest
//   dimension  whole action channels, in every step; round(ratio * channels) of them
//
// The ratio is that of what is chosen now, whatever is missing already; the result misses both. So
// removing only ever adds to what is missing, and doing it twice with one seed is doing it once
// with the larger ratio.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "agail/demos/demonstrations.h"

namespace agail {

// Values take part in naming the random stream: never renumber.
enum class MaskPattern : std::uint32_t { kStep = 0, kBlock = 1, kEpisode = 2, kDimension = 3 };

inline constexpr Eigen::Index kMaskBlockSteps = 20;

// Throws InputError, naming the patterns, if there is none of that name.
MaskPattern mask_pattern(const std::string& name);
const char* name_of(MaskPattern pattern);

struct MaskOptions {
  MaskPattern pattern = MaskPattern::kStep;
  double ratio = 0;  // in [0, 1]
  std::uint64_t seed = 0;
  // kDimension only: this channel, counted from 0, goes first; with a ratio above 0 it goes in any
  // case.
  std::optional<int> dimension;
};

// Removed entries become NaN (discrete: 0) and unavailable; demonstrations.pattern gets the
// pattern's name, after a
// "+" if another one was there. Throws InputError if an option does not fit the demonstrations.
void remove_actions(Demonstrations& demonstrations, const MaskOptions& options);

}  // namespace agail
