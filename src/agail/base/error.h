// Three kinds of failure, kept apart because the command line answers them differently.
#pragma once

#include <stdexcept>
#include <string>

namespace agail {

// The user's input is wrong. The message is one line: what, where, how to mend it. Exit code 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The machine let us down (disk full, I/O error), or a promise of the library broke. Exit code 1.
class SystemError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A message as it goes to a terminal: names that it quotes may hold line ends and escape sequences,
// which become spaces.
std::string one_line(std::string message);

[[noreturn]] void check_failed(const char* condition, const char* file, int line);

}  // namespace agail

// A condition that only a bug of ours can break.
#define AGAIL_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::agail::check_failed(#condition, __FILE__, __LINE__))
