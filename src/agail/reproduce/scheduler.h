// Does jobs, several at a time, each at most once for all processes that share its lock.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "agail/reproduce/job.h"

namespace agail {

enum class JobState {
  kWaiting,    // for what it needs, or for a free place
  kElsewhere,  // another process is at it
  kRunning,
  kDone,
  kFailed,
  kImpossible  // something that it needs has failed
};

struct JobStatus {
  JobState state = JobState::kWaiting;
  bool done_before = false;  // by an earlier start or another process: no work of this one
  double share = 0;          // of a running job that is done
};

// Tells how it goes. `update` is called often, `failed` once a failure.
class JobObserver {
 public:
  virtual ~JobObserver() = default;
  virtual void update(std::span<const Job> jobs, std::span<const JobStatus> status) = 0;
  virtual void failed(const Job& job, const std::string& how) = 0;
};

struct JobsOutcome {
  int signal = 0;  // that stopped it
  int failed = 0, impossible = 0;
};

// Takes jobs in their order as soon as what they need is done, `at_once` at a time. Jobs whose
// results exist are done; one that another process holds is waited for. A job that fails does not
// stop the others. On SIGINT or SIGTERM the children are told to stop (SIGINT) and waited for. The
// caller must have one thread only.
JobsOutcome run_jobs(std::span<const Job> jobs, int at_once, JobObserver& observer);

}  // namespace agail
