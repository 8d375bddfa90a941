// Work in a process of its own.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace agail {

// Forks; the child runs `work` and ends with the exit code that it returns (1 and a line in the log
// if it throws). Its output is added to `log`. Of the caller's files it keeps only `kept`, a lock.
// It is in a process group of its own, so that a terminal's Ctrl-C reaches only the caller, and
// gets a SIGTERM when the caller dies. The caller must have one thread only.
pid_t start_child(const std::function<int()>& work, const std::filesystem::path& log, int kept);

// Replaces this process by this same program with other arguments; returns only if that fails.
int execute_ourselves(const std::vector<std::string>& arguments);

}  // namespace agail
