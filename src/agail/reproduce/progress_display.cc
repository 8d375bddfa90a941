#include "agail/reproduce/progress_display.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace agail {

namespace {

std::string duration(double seconds) {
  const auto s = std::llround(std::max(seconds, 0.0));
  char text[32];
  std::snprintf(text, sizeof text, "%lld:%02lld:%02lld", s / 3600, s / 60 % 60, s % 60);
  return text;
}

std::string column_name(const Cell& cell) {
  if (cell.method != "agail") return cell.method;
  return "agail " + std::to_string(std::lround(100 * *cell.missing)) + " %";
}

std::string right_aligned(std::string text, std::size_t width) {
  if (text.size() < width) text.insert(0, width - text.size(), ' ');
  return text;
}

bool is_settled(JobState state) {
  return state == JobState::kDone || state == JobState::kFailed || state == JobState::kImpossible;
}

}  // namespace

ProgressDisplay::ProgressDisplay(std::vector<std::optional<Cell>> cells, int at_once)
    : cells_(std::move(cells)), at_once_(at_once), terminal_(isatty(STDERR_FILENO) == 1) {}

void ProgressDisplay::update(std::span<const Job> jobs, std::span<const JobStatus> status) {
  status_.assign(status.begin(), status.end());
  const auto settled = static_cast<std::size_t>(std::count_if(
      status.begin(), status.end(), [](const JobStatus& s) { return is_settled(s.state); }));
  const double since = std::chrono::duration<double>(Clock::now() - shown_).count();
  // A terminal is redrawn every half second; a file gets a line when something was settled, at most
  // every ten seconds.
  if (since > (terminal_ ? 0.5 : 10.0) && (terminal_ || settled != settled_shown_ || since > 300)) {
    settled_shown_ = settled;
    show(jobs);
  }
}

void ProgressDisplay::failed(const Job& job, const std::string& how) {
  erase();
  std::fprintf(stderr, "agail: %s %s; its log: %s\n", job.title.c_str(), how.c_str(),
               job.log.c_str());
}

void ProgressDisplay::finish(std::span<const Job> jobs) { show(jobs); }

void ProgressDisplay::erase() {
  if (lines_shown_ > 0) std::fprintf(stderr, "\x1b[%dA\x1b[J", lines_shown_);
  lines_shown_ = 0;
}

void ProgressDisplay::show(std::span<const Job> jobs) {
  shown_ = Clock::now();
  erase();
  std::string text = summary(jobs);
  if (terminal_) text = table() + running(jobs) + text;
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
  if (terminal_) lines_shown_ = static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

// Runs done of each cell: environments down, methods across.
std::string ProgressDisplay::table() const {
  std::vector<std::string> rows, columns;
  const auto add = [](std::vector<std::string>& names, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  for (const Cell& cell : table_cells()) {
    for (const auto& own : cells_) {
      if (own != cell) continue;
      add(rows, cell.environment);
      add(columns, column_name(cell));
    }
  }
  std::string text = right_aligned("", 12);
  for (const std::string& column : columns) text += "  " + column;
  text += "\n";
  for (const std::string& row : rows) {
    text += row + std::string(12 - std::min<std::size_t>(12, row.size()), ' ');
    for (const std::string& column : columns) {
      int all = 0, done = 0;
      for (std::size_t i = 0; i < cells_.size(); ++i) {
        if (!cells_[i] || cells_[i]->environment != row || column_name(*cells_[i]) != column)
          continue;
        ++all;
        done += status_[i].state == JobState::kDone;
      }
      text += "  " + right_aligned(all > 0 ? std::to_string(done) + "/" + std::to_string(all) : "-",
                                   column.size());
    }
    text += "\n";
  }
  return text;
}

std::string ProgressDisplay::running(std::span<const Job> jobs) const {
  std::string text;
  for (std::size_t i = 0; i < jobs.size(); ++i)
    if (status_[i].state == JobState::kRunning)
      text += "  " + jobs[i].title + "  " + std::to_string(std::lround(100 * status_[i].share)) +
              " %\n";
  return text;
}

std::string ProgressDisplay::summary(std::span<const Job> jobs) const {
  int done = 0, running = 0, elsewhere = 0, failed = 0;
  double made = 0, left = 0;  // seconds of a core, by the jobs' rough costs
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const JobStatus& status = status_[i];
    done += status.state == JobState::kDone;
    running += status.state == JobState::kRunning;
    elsewhere += status.state == JobState::kElsewhere;
    failed += status.state == JobState::kFailed || status.state == JobState::kImpossible;
    if (status.state == JobState::kRunning || !status.done_before)
      made += status.share * jobs[i].cost;
    if (status.state == JobState::kRunning || status.state == JobState::kWaiting)
      left += (1 - status.share) * jobs[i].cost;
  }
  const double elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
  // What has been made tells how rough the costs are; before that they are believed.
  const double speed = made > 0.01 * left ? made / elapsed : at_once_;
  std::string text = std::to_string(done) + "/" + std::to_string(jobs.size()) + " done, " +
                     std::to_string(running) + " running";
  if (elsewhere > 0) text += ", " + std::to_string(elsewhere) + " elsewhere";
  if (failed > 0) text += ", " + std::to_string(failed) + " failed";
  return text + ", left " + duration(left / speed) + "\n";
}

}  // namespace agail
