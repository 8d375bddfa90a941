// Notices ranks that no longer run: stopped, swapped out, or behind a network that is gone. (One
// whose process ends is noticed by the launcher.)
#pragma once

#include <mpi.h>

#include <atomic>
#include <string>
#include <thread>

namespace agail {

// Every second each rank tells the next one that it is there, and listens to the one before. Needs
// MPI_THREAD_MULTIPLE.
class MpiHeartbeat {
 public:
  // `own` and `previous`: the names of this rank and of the one that it listens to.
  MpiHeartbeat(MPI_Comm communicator, std::string own, std::string previous);
  // All ranks must come here at about the same time: the last word is waited for.
  ~MpiHeartbeat();
  MpiHeartbeat(const MpiHeartbeat&) = delete;
  MpiHeartbeat& operator=(const MpiHeartbeat&) = delete;

 private:
  void run();

  MPI_Comm communicator_;
  std::string own_, previous_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace agail
