// The live table of the grid on a terminal, redrawn in place; elsewhere a line now and then. On
// stderr.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "agail/reproduce/experiment.h"
#include "agail/reproduce/scheduler.h"

namespace agail {

class ProgressDisplay : public JobObserver {
 public:
  // cells[i]: whose run job i is; none: an expert or demonstrations.
  ProgressDisplay(std::vector<std::optional<Cell>> cells, int at_once);
  void update(std::span<const Job> jobs, std::span<const JobStatus> status) override;
  void failed(const Job& job, const std::string& how) override;
  // Shows where it stands, for the last time.
  void finish(std::span<const Job> jobs);

 private:
  using Clock = std::chrono::steady_clock;
  std::string table() const;
  std::string running(std::span<const Job> jobs) const;
  std::string summary(std::span<const Job> jobs) const;
  void show(std::span<const Job> jobs);
  void erase();

  std::vector<std::optional<Cell>> cells_;
  int at_once_;
  bool terminal_;
  int lines_shown_ = 0;
  Clock::time_point begin_ = Clock::now(), shown_;
  std::vector<JobStatus> status_;
  std::size_t settled_shown_ = 0;
};

}  // namespace agail
