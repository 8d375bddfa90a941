#include "agail/demos/trial.h"

#include <fcntl.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): POSIX's, not C's
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

namespace agail {
namespace {

[[noreturn]] void run_child(const std::function<void()>& work, unsigned cpu_seconds) {
  // Quietly: nobody else's signal handlers, no core file, no message of a sanitizer or of libc.
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGXCPU})
    ::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const rlimit cpu{cpu_seconds, cpu_seconds};
  ::setrlimit(RLIMIT_CPU, &cpu);
  const int nowhere = ::open("/dev/null", O_WRONLY);
  if (nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
  try {
    work();
  } catch (...) {  // the parent will meet it, too
  }
  ::_exit(0);
}

}  // namespace

bool survives_trial(const std::function<void()>& work, unsigned cpu_seconds) {
  const pid_t child = ::fork();
  if (child < 0) return true;
  if (child == 0) run_child(work, cpu_seconds);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return true;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace agail
