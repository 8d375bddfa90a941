// One piece of the experiment: what it needs, how it is done, and how one sees that it is done.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace agail {

struct Job {
  std::string title;  // for people
  // Written atomically, after everything else: where all of them exist, the job is done.
  std::vector<std::filesystem::path> results;
  std::filesystem::path lock, log;  // whoever holds the lock (FileLock) may do the job
  std::vector<std::size_t> needs;   // jobs that must be done before
  // Each runs in a process of its own, one after the other, and returns its exit code.
  std::vector<std::function<int()>> steps;
  double cost = 0;                 // seconds of a core, roughly: for the time left
  std::filesystem::path progress;  // a progress.csv to watch; empty: none
  double timesteps = 0;            // at its end
};

inline bool is_done(const Job& job) {
  return std::ranges::all_of(job.results, [](const auto& file) { return exists(file); });
}

}  // namespace agail
