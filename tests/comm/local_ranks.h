// Ranks that are threads of the test: messages go through queues.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "agail/comm/communicator.h"

namespace agail {

class LocalRanks {
 public:
  // Calls work(communicator) on `ranks` threads at once; rethrows the first rank's exception.
  static void run(int ranks, const std::function<void(Communicator&)>& work) {
    LocalRanks job(ranks);
    std::vector<std::thread> threads;
    std::vector<std::exception_ptr> failures(static_cast<std::size_t>(ranks));
    for (int rank = 0; rank < ranks; ++rank)
      threads.emplace_back([&, rank] {
        try {
          One one(job, rank);
          work(one);
        } catch (...) {
          failures[static_cast<std::size_t>(rank)] = std::current_exception();
        }
      });
    for (std::thread& thread : threads) thread.join();
    for (const std::exception_ptr& failure : failures)
      if (failure) std::rethrow_exception(failure);
  }

 private:
  struct Queue {
    std::mutex mutex;
    std::condition_variable arrived;
    std::deque<Bytes> messages;
  };

  class One final : public Communicator {
   public:
    One(LocalRanks& job, int rank) : job_(job), rank_(rank) {}
    int rank() const override { return rank_; }
    int ranks() const override { return job_.ranks_; }
    void abort(int) override { throw std::runtime_error("aborted"); }

   private:
    void do_send(int to, std::span<const std::byte> message) override {
      Queue& queue = job_.queue(rank_, to);
      const std::lock_guard lock(queue.mutex);
      queue.messages.emplace_back(message.begin(), message.end());
      queue.arrived.notify_one();
    }
    void do_receive(int from, Bytes& message) override {
      Queue& queue = job_.queue(from, rank_);
      std::unique_lock lock(queue.mutex);
      if (!queue.arrived.wait_for(lock, std::chrono::seconds(20),
                                  [&] { return !queue.messages.empty(); }))
        throw std::runtime_error("nothing comes from rank " + std::to_string(from));
      message = std::move(queue.messages.front());
      queue.messages.pop_front();
    }
    void do_exchange(int to, std::span<const std::byte> out, int from, Bytes& in) override {
      do_send(to, out);
      do_receive(from, in);
    }
    LocalRanks& job_;
    int rank_;
  };

  explicit LocalRanks(int ranks)
      : ranks_(ranks), queues_(static_cast<std::size_t>(ranks) * static_cast<std::size_t>(ranks)) {}
  Queue& queue(int from, int to) {
    return queues_[static_cast<std::size_t>(from) * static_cast<std::size_t>(ranks_) +
                   static_cast<std::size_t>(to)];
  }

  int ranks_;
  std::vector<Queue> queues_;
};

}  // namespace agail
