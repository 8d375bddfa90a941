// Whether this process is one of several, and how they find each other.
#pragma once

#include <memory>
#include <optional>

#include "agail/comm/communicator.h"

namespace agail {

// Joins the other ranks if a launcher (mpirun, srun) started this process, else returns a
// communicator for one. InputError if there are several ranks and this build cannot join them.
std::unique_ptr<Communicator> join_ranks();

// What the launcher says of this process; none without a launcher.
struct LaunchedProcess {
  int rank = 0, ranks = 1;
};
std::optional<LaunchedProcess> launched_process();

// Takes the launcher's variables out of the environment, so that programs which this one starts do
// not take themselves for its ranks.
void forget_launcher();

// Whether the launcher gave this process rank 0; true without a launcher. Needs no communicator.
bool is_first_rank();

// Ranks that the launcher started on this machine; 1 without a launcher.
int ranks_on_this_machine();

}  // namespace agail
