#include "agail/comm/mpi/mpi_communicator.h"

#include <mpi.h>
#include <sched.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>
#include <thread>

#include "agail/base/error.h"
#include "agail/comm/collectives.h"
#include "agail/comm/mpi/mpi_heartbeat.h"

namespace agail {

namespace {

// Waits in steps that grow: a message that is about to come is taken at once, and a long wait
// leaves the core to others (ranks may be more than cores). MPI's own blocking calls never sleep.
class Patience {
 public:
  void wait() {
    ++tries_;
    if (tries_ < 200) return;
    if (tries_ < 400)
      sched_yield();
    else
      std::this_thread::sleep_for(std::chrono::microseconds(tries_ < 2000 ? 20 : 200));
  }

 private:
  int tries_ = 0;
};

void finish(MPI_Request& request) {
  Patience patience;
  for (int flag = 0;;) {
    MPI_Test(&request, &flag, MPI_STATUS_IGNORE);
    if (flag != 0) return;
    patience.wait();
  }
}

int count_of(std::size_t bytes) {
  if (bytes > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw SystemError(
        "a message between ranks would be larger than 2 GiB; use fewer steps a batch");
  return static_cast<int>(bytes);
}

class MpiCommunicator final : public Communicator {
 public:
  explicit MpiCommunicator(bool watched) {
    MPI_Comm_dup(MPI_COMM_WORLD, &work_);
    MPI_Comm_rank(work_, &rank_);
    MPI_Comm_size(work_, &ranks_);
    std::array<char, 256> host{};
    gethostname(host.data(), host.size() - 1);
    const std::string own = host.data();
    Blocks hosts;
    allgather(*this, std::as_bytes(std::span(own)), hosts);
    for (int r = 0; r < ranks_; ++r)
      hosts_.emplace_back(reinterpret_cast<const char*>(hosts[r].data()), hosts[r].size());
    if (ranks_ == 1) return;
    if (watched) {
      MPI_Comm_dup(MPI_COMM_WORLD, &watch_);
      heartbeat_.emplace(watch_, name(rank_), name((rank_ + ranks_ - 1) % ranks_));
    } else if (rank_ == 0) {
      std::fputs(
          "agail: note: this MPI has no MPI_THREAD_MULTIPLE: a rank that is stuck goes unnoticed\n",
          stderr);
    }
  }

  ~MpiCommunicator() override {
    largest(*this, 0);  // all are here: nobody misses another's heartbeat
    heartbeat_.reset();
    if (watch_ != MPI_COMM_NULL) MPI_Comm_free(&watch_);
    MPI_Comm_free(&work_);
    MPI_Finalize();
  }

  int rank() const override { return rank_; }
  int ranks() const override { return ranks_; }
  std::string name(int rank) const override {
    return "rank " + std::to_string(rank) + " on " + hosts_[static_cast<std::size_t>(rank)];
  }
  void abort(int exit_code) override {
    MPI_Abort(MPI_COMM_WORLD, exit_code);
    std::_Exit(exit_code);
  }

 private:
  void do_send(int to, std::span<const std::byte> message) override {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Isend(message.data(), count_of(message.size()), MPI_BYTE, to, 0, work_, &request);
    finish(request);
  }

  void do_receive(int from, Bytes& message) override {
    MPI_Message found = MPI_MESSAGE_NULL;
    MPI_Status status;
    Patience patience;
    for (int flag = 0;;) {
      MPI_Improbe(from, 0, work_, &flag, &found, &status);
      if (flag != 0) break;
      patience.wait();
    }
    int count = 0;
    MPI_Get_count(&status, MPI_BYTE, &count);
    message.resize(static_cast<std::size_t>(count));
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Imrecv(message.data(), count, MPI_BYTE, &found, &request);
    finish(request);
  }

  void do_exchange(int to, std::span<const std::byte> out, int from, Bytes& in) override {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Isend(out.data(), count_of(out.size()), MPI_BYTE, to, 0, work_, &request);
    do_receive(from, in);
    finish(request);
  }

  MPI_Comm work_ = MPI_COMM_NULL, watch_ = MPI_COMM_NULL;
  int rank_ = 0, ranks_ = 1;
  std::vector<std::string> hosts_;
  std::optional<MpiHeartbeat> heartbeat_;
};

}  // namespace

std::unique_ptr<Communicator> join_mpi_ranks() {
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_MULTIPLE, &provided);
  return std::make_unique<MpiCommunicator>(provided == MPI_THREAD_MULTIPLE);
}

}  // namespace agail
