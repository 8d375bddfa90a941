#include "agail/base/interrupt.h"

#include <atomic>
#include <mutex>

namespace agail {
namespace {

std::atomic<int> first_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);  // or a handler may not touch it

std::mutex mutex;
int guards = 0;
struct sigaction old_int {};  // written only while our handlers are not installed
struct sigaction old_term {};

extern "C" void note_signal(int signal) {
  int none = 0;
  first_signal.compare_exchange_strong(none, signal);
  // The second one is none of our business. (sigaction may be called by a handler.)
  struct sigaction next = signal == SIGINT ? old_int : old_term;
  if (next.sa_handler == SIG_IGN) next.sa_handler = SIG_DFL;
  sigaction(signal, &next, nullptr);
}

}  // namespace

InterruptGuard::InterruptGuard() {
  const std::lock_guard lock(mutex);
  alone_ = guards++ == 0;
  if (!alone_) return;
  first_signal = 0;
  sigaction(SIGINT, nullptr, &old_int);
  sigaction(SIGTERM, nullptr, &old_term);
  struct sigaction action {};
  action.sa_handler = note_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

InterruptGuard::~InterruptGuard() {
  const std::lock_guard lock(mutex);
  if (--guards > 0) return;
  sigaction(SIGINT, &old_int, nullptr);
  sigaction(SIGTERM, &old_term, nullptr);
}

int interrupted() { return first_signal; }

}  // namespace agail
