// Ctrl-C and `kill`: noted, so that long work can save a checkpoint and stop.
#pragma once

#include <csignal>

namespace agail {

// While it lives, the first SIGINT and the first SIGTERM are only noted; the second of a kind ends
// the process as usual. A SIGINT that the parent ignores (a shell's background jobs) is noted, too:
// an explicit `kill -INT` must save a checkpoint. One guard at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
};

// The first signal noted since the newest guard was built, else 0. The exit code is 128 + signal.
int interrupted();

}  // namespace agail
