// One piece of the experiment: what it needs, how it is done, and how one sees that it is done.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace agail {

struct Job {
  std::string title;             // for people
  std::filesystem::path result;  // written atomically, last: where it exists, the job is done
  std::filesystem::path lock, log;
  std::vector<std::size_t> needs;  // jobs that must be done before
  // Each runs in a process of its own, one after the other, and returns its exit code.
  std::vector<std::function<int()>> steps;
  double cost = 0;                 // seconds of a core, roughly: for the time left
  std::filesystem::path progress;  // a progress.csv to watch; empty: none
  double timesteps = 0;            // at its end
};

// Whoever holds it may do the job; across processes, and machines that share a file system with
// locks. The lock belongs to the open file: it ends with the last process that has it open, so that
// a killed owner leaves no stale lock, and a child that outlives its parent still holds its own.
class JobLock {
 public:
  // Not held if another process has it. SystemError if the file system has no locks.
  explicit JobLock(const std::filesystem::path& file);
  ~JobLock();
  JobLock(JobLock&& other) noexcept;
  JobLock& operator=(JobLock&& other) noexcept;
  bool held() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_ = -1;
};

}  // namespace agail
