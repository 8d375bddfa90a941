#include "agail/comm/launch.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

#include "agail/base/error.h"
#include "agail/comm/mpi/mpi_communicator.h"

namespace agail {

namespace {

// The first of these variables that is set, as a number; -1: none is.
int number_of(std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const char* value = std::getenv(name)) return std::atoi(value);
  return -1;
}

int launched_rank() { return number_of({"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"}); }

// PMIx does not say how many there are; SLURM does.
int launched_ranks() {
  return number_of({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"});
}

}  // namespace

int ranks_on_this_machine() {
  if (launched_rank() < 0) return 1;
  return std::max(
      1, number_of({"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_TASKS_PER_NODE"}));
}

std::optional<LaunchedProcess> launched_process() {
  if (launched_rank() < 0) return std::nullopt;
  return LaunchedProcess{launched_rank(), std::max(launched_ranks(), launched_rank() + 1)};
}

void forget_launcher() {
  std::vector<std::string> names;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string name = std::string(*variable).substr(0, std::strcspn(*variable, "="));
    for (const char* prefix : {"OMPI_", "PMIX_", "PMI_", "SLURM_STEP"})
      if (name.starts_with(prefix)) names.push_back(name);
  }
  for (const std::string& name : names) unsetenv(name.c_str());
}

bool is_first_rank() { return launched_rank() <= 0; }

std::unique_ptr<Communicator> join_ranks() {
  if (launched_rank() < 0) return std::make_unique<SerialCommunicator>();
  if (std::unique_ptr<Communicator> mpi = join_mpi_ranks()) return mpi;
  if (launched_ranks() > 1)
    throw InputError("started as " + std::to_string(launched_ranks()) +
                     " ranks, but this agail was built without MPI; install libopenmpi-dev and "
                     "build again (cmake -DAGAIL_MPI=ON), or start one process");
  return std::make_unique<SerialCommunicator>();
}

}  // namespace agail
