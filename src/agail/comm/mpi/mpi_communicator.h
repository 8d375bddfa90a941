// Ranks that are MPI processes.
#pragma once

#include <memory>

#include "agail/comm/communicator.h"

namespace agail {

// Starts MPI; its end is that of the result, which all ranks must reach. Null in a build without
// MPI. A rank that is not heard of for 15 seconds is named on stderr, and all ranks end.
std::unique_ptr<Communicator> join_mpi_ranks();

}  // namespace agail
