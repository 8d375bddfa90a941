#include "agail/reproduce/child_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>

#include "agail/base/error.h"

namespace agail {

namespace {

void set_up(const std::filesystem::path& log, int kept, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(1);  // it died before that
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  const int input = ::open("/dev/null", O_RDONLY);
  const int output = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
  if (input < 0 || output < 0) ::_exit(1);
  ::dup2(input, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  const auto lock = static_cast<unsigned>(kept);
  if (lock > 3) ::close_range(3, lock - 1, 0);
  ::close_range(lock + 1, ~0U, 0);
  ::fcntl(kept, F_SETFD, 0);  // the lock lives on in the program that this one becomes
}

}  // namespace

pid_t start_child(const std::function<int()>& work, const std::filesystem::path& log, int kept) {
  std::cout.flush();
  std::fflush(nullptr);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) throw SystemError("cannot start a process: " + std::string(std::strerror(errno)));
  if (child > 0) return child;
  set_up(log, kept, parent);
  int code = 1;
  try {
    code = work();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "agail: %s\n", e.what());
  }
  std::cout.flush();
  std::fflush(nullptr);
  ::_exit(code);
}

int execute_ourselves(const std::vector<std::string>& arguments) {
  std::string line = "$ agail";
  for (const std::string& argument : arguments) line += " " + argument;
  std::fprintf(stderr, "%s\n", line.c_str());
  std::vector<std::string> copy = arguments;
  copy.insert(copy.begin(), "agail");
  std::vector<char*> pointers;
  for (std::string& argument : copy) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  ::execv("/proc/self/exe", pointers.data());
  throw SystemError("cannot start this program again: " + std::string(std::strerror(errno)));
}

}  // namespace agail
