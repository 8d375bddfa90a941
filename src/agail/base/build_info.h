// What this build is and runs on.
#pragma once

#include <string>

namespace agail {

inline constexpr const char* kVersion = AGAIL_VERSION;

// Instruction sets that this machine has and bits depend on, e.g. "x86-64 avx2 fma avx512f".
std::string cpu_features();

}  // namespace agail
