#include "agail/reproduce/scheduler.h"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "agail/base/error.h"
#include "agail/base/file_lock.h"
#include "agail/base/interrupt.h"
#include "agail/reproduce/child_process.h"

namespace agail {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPause{20};           // between looks at our own children
constexpr milliseconds kLookElsewhere{500};  // between looks at what others do
constexpr milliseconds kLookAtProgress{1000};

// The first number of the last whole line.
double last_timesteps(const std::filesystem::path& progress) {
  std::ifstream file(progress, std::ios::binary | std::ios::ate);
  const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : 0;
  constexpr std::streamoff kTail = 4096;
  std::string tail(static_cast<std::size_t>(std::min(size, kTail)), '\0');
  file.seekg(size - static_cast<std::streamoff>(tail.size()));
  file.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  const std::size_t end = tail.rfind('\n');
  if (end == std::string::npos || end == 0) return 0;
  const std::size_t begin = tail.rfind('\n', end - 1);
  if (begin == std::string::npos) return 0;
  double value = 0;
  std::from_chars(tail.data() + begin + 1, tail.data() + end, value);
  return value;
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return "was ended by signal " + std::to_string(WTERMSIG(status));
  return "failed with exit code " + std::to_string(WEXITSTATUS(status));
}

class Scheduler {
 public:
  Scheduler(std::span<const Job> jobs, int at_once, JobObserver& observer)
      : jobs_(jobs), at_once_(at_once), observer_(observer), status_(jobs.size()) {}

  JobsOutcome run() {
    for (std::size_t i = 0; i < jobs_.size(); ++i) note_if_done(i);
    while (!settled() && interrupted() == 0) {
      look_at_children();
      start_what_can_be();
      look_at_progress();
      observer_.update(jobs_, status_);
      std::this_thread::sleep_for(kPause);
    }
    stop_children();
    observer_.update(jobs_, status_);
    JobsOutcome outcome{interrupted(), 0, 0};
    for (const JobStatus& status : status_) {
      outcome.failed += status.state == JobState::kFailed;
      outcome.impossible += status.state == JobState::kImpossible;
    }
    return outcome;
  }

 private:
  struct Running {
    std::size_t job;
    FileLock lock;
    std::size_t step = 0;
    pid_t process = 0;
  };

  bool settled() const {
    return std::all_of(status_.begin(), status_.end(), [](const JobStatus& status) {
      return status.state == JobState::kDone || status.state == JobState::kFailed ||
             status.state == JobState::kImpossible;
    });
  }

  bool note_if_done(std::size_t i) {
    if (!is_done(jobs_[i])) return false;
    status_[i] = {JobState::kDone, true, 1};
    return true;
  }

  void look_at_children() {
    for (std::size_t r = 0; r < running_.size();) {
      Running& running = running_[r];
      int ended = 0;
      if (::waitpid(running.process, &ended, WNOHANG) != running.process) {
        ++r;
        continue;
      }
      const Job& job = jobs_[running.job];
      const bool good = WIFEXITED(ended) && WEXITSTATUS(ended) == 0;
      if (good && ++running.step < job.steps.size()) {
        start_step(running);
        continue;
      }
      const bool done = good && is_done(job);
      status_[running.job] = {done ? JobState::kDone : JobState::kFailed, false, done ? 1.0 : 0.0};
      if (!done) observer_.failed(job, good ? "left no result" : how_it_ended(ended));
      running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(r));
    }
  }

  void start_step(Running& running) {
    const Job& job = jobs_[running.job];
    running.process = start_child(job.steps[running.step], job.log, running.lock.descriptor());
  }

  void start_what_can_be() {
    const bool look_elsewhere = Clock::now() - looked_elsewhere_ >= kLookElsewhere;
    if (look_elsewhere) looked_elsewhere_ = Clock::now();
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      JobStatus& status = status_[i];
      const bool waiting = status.state == JobState::kWaiting;
      if (!waiting && !(status.state == JobState::kElsewhere && look_elsewhere)) continue;
      bool ready = true;
      for (const std::size_t need : jobs_[i].needs) {
        const JobState state = status_[need].state;
        ready = ready && state == JobState::kDone;
        if (state == JobState::kFailed || state == JobState::kImpossible)
          status.state = JobState::kImpossible;
      }
      const bool place = running_.size() < static_cast<std::size_t>(at_once_);
      if (!ready || !(place || look_elsewhere) || note_if_done(i) || !place) continue;
      FileLock lock(jobs_[i].lock);
      if (!lock.held()) {
        status.state = JobState::kElsewhere;
      } else if (!note_if_done(i)) {  // nobody finished it between the two looks
        status.state = JobState::kRunning;
        running_.push_back({i, std::move(lock)});
        start_step(running_.back());
      }
    }
  }

  void look_at_progress() {
    if (Clock::now() - looked_at_progress_ < kLookAtProgress) return;
    looked_at_progress_ = Clock::now();
    for (const Running& running : running_) {
      const Job& job = jobs_[running.job];
      if (!job.progress.empty() && job.timesteps > 0)
        status_[running.job].share = std::min(1.0, last_timesteps(job.progress) / job.timesteps);
    }
  }

  void stop_children() {
    for (const Running& running : running_) ::kill(running.process, SIGINT);
    for (Running& running : running_) {
      while (::waitpid(running.process, nullptr, 0) < 0 && errno == EINTR) {
      }
      status_[running.job].state = JobState::kWaiting;
    }
    running_.clear();
  }

  std::span<const Job> jobs_;
  int at_once_;
  JobObserver& observer_;
  std::vector<JobStatus> status_;
  std::vector<Running> running_;
  Clock::time_point looked_elsewhere_, looked_at_progress_;
};

}  // namespace

JobsOutcome run_jobs(std::span<const Job> jobs, int at_once, JobObserver& observer) {
  const InterruptGuard guard;
  return Scheduler(jobs, at_once, observer).run();
}

}  // namespace agail
