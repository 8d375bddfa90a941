// What the arithmetic units of one core can do at most.
#pragma once

namespace agail {

// Single-precision floating-point operations a second: multiply-adds of whole packets in registers,
// best of several short runs.
double peak_flops_per_second();

}  // namespace agail
