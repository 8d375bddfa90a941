// Episodes of a policy, and what they say.
#pragma once

#include <functional>
#include <vector>

#include "agail/comm/team.h"
#include "agail/demos/demonstrations.h"
#include "agail/train/saved_policy.h"

namespace agail {

struct Evaluation {
  std::vector<double> returns;  // undiscounted, one an episode
  std::vector<double> lengths;
  std::int64_t diverged = 0;  // episodes that ended because the simulation broke down

  double mean_return() const;
  double mean_length() const;
  double standard_error() const;  // sample standard deviation / sqrt(n); 0 for one episode
};

// 95 % percentile bootstrap interval of the mean (Efron), from 10,000 resamples.
std::pair<double, double> bootstrap_interval(const std::vector<double>& values, std::uint64_t seed);

// Thrown where a signal came before the last episode had ended: there is no part of an evaluation.
struct EpisodesInterrupted {
  int signal;
};

// Episode e is the same for any number of threads and ranks (which share the episodes): reset and
// actions have streams of their own.
// Takes the mode of the policy unless `stochastic`. With `stops_on_signals`, for a caller who holds
// an InterruptGuard, a signal that was noted ends it (EpisodesInterrupted); without, it goes on: a
// run whose update is evaluated stops afterwards.
Evaluation evaluate(const SavedPolicy& policy, Index episodes, std::uint64_t seed, bool stochastic,
                    Team team, bool stops_on_signals = false);

// The same episodes (under streams of their own) as complete demonstrations.
Demonstrations record(const SavedPolicy& policy, Index episodes, std::uint64_t seed,
                      bool stochastic, ThreadPool& pool, bool stops_on_signals = false);

}  // namespace agail
