// Trying something in a child process first, because the library that does it can crash on damaged
// input: HDF5 1.10 follows some of a file's pointers without checking them.
#pragma once

#include <functional>

namespace agail {

// Runs `work` in a child process and throws its results away, exceptions included. False if the
// child crashed or used more processor time than that; true if it came through, or if there can be
// no child here.
bool survives_trial(const std::function<void()>& work, unsigned cpu_seconds);

}  // namespace agail
