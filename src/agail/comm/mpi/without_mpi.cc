#include "agail/comm/mpi/mpi_communicator.h"

namespace agail {

std::unique_ptr<Communicator> join_mpi_ranks() { return nullptr; }

}  // namespace agail
