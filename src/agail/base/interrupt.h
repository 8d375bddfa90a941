// Ctrl-C and `kill`: noted, so that long work can save a checkpoint and stop.
#pragma once

#include <csignal>

namespace agail {

// While it lives, the first SIGINT and the first SIGTERM are only noted; the second of a kind is
// handled as it was before (it ends the process, unless somebody had a handler). A SIGINT that the
// parent ignores (a shell's background jobs) is noted, too: an explicit `kill -INT` must save a
// checkpoint; a second one ends the process. Guards of several threads share what is noted.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  // Whether there was no other when it was built. Signals of a guard that was there before are for
  // that one to answer.
  bool alone() const { return alone_; }

 private:
  bool alone_ = false;
};

// The first signal noted since a guard was built while there was no other; 0: none. It is still
// known when the last guard has gone. The exit code is 128 + signal.
int interrupted();

}  // namespace agail
