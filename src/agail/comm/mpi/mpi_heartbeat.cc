#include "agail/comm/mpi/mpi_heartbeat.h"

#include <chrono>
#include <csignal>
#include <cstdio>

namespace agail {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPoll = std::chrono::milliseconds(50);
constexpr auto kBeat = std::chrono::seconds(1);
constexpr auto kPatience = std::chrono::seconds(15);
// If this thread itself did not run for so long, the whole job may have slept.
constexpr auto kSlept = std::chrono::seconds(3);

constexpr int kThere = 0, kLeaving = 1;

bool done(MPI_Request& request) {
  int flag = 0;
  MPI_Test(&request, &flag, MPI_STATUS_IGNORE);
  return flag != 0;
}

}  // namespace

MpiHeartbeat::MpiHeartbeat(MPI_Comm communicator, std::string own, std::string previous)
    : communicator_(communicator), own_(std::move(own)), previous_(std::move(previous)) {
  // Signals are the main thread's.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

MpiHeartbeat::~MpiHeartbeat() {
  ending_ = true;
  thread_.join();
}

void MpiHeartbeat::run() {
  int rank = 0, ranks = 1;
  MPI_Comm_rank(communicator_, &rank);
  MPI_Comm_size(communicator_, &ranks);
  const int next = (rank + 1) % ranks, previous = (rank + ranks - 1) % ranks;
  int out = kThere, in = kThere;
  MPI_Request sending = MPI_REQUEST_NULL, receiving = MPI_REQUEST_NULL;
  MPI_Irecv(&in, 1, MPI_INT, previous, 0, communicator_, &receiving);
  Clock::time_point now = Clock::now(), heard = now, told = now - kBeat;
  bool said_last_word = false, heard_last_word = false;
  while (!said_last_word || !heard_last_word || !done(sending)) {
    const Clock::time_point before = now;
    now = Clock::now();
    if (now - before > kSlept) heard = now;
    if (!heard_last_word && done(receiving)) {
      heard = now;
      heard_last_word = in == kLeaving;
      if (!heard_last_word) MPI_Irecv(&in, 1, MPI_INT, previous, 0, communicator_, &receiving);
    }
    const bool ending = ending_;
    if (!said_last_word && (ending || now - told >= kBeat) && done(sending)) {
      out = ending ? kLeaving : kThere;
      said_last_word = ending;
      told = now;
      MPI_Isend(&out, 1, MPI_INT, next, 0, communicator_, &sending);
    }
    if (!heard_last_word && now - heard > kPatience) {
      std::fprintf(stderr,
                   "agail: %s: %s has not been heard of for %d seconds (stopped, or cut off?); "
                   "the job ends; go on from its last checkpoint with --resume\n",
                   own_.c_str(), previous_.c_str(), static_cast<int>(kPatience.count()));
      std::fflush(stderr);
      MPI_Abort(MPI_COMM_WORLD, 1);
    }
    std::this_thread::sleep_for(ending ? std::chrono::milliseconds(1) : kPoll);
  }
}

}  // namespace agail
