// Ranks: processes, perhaps on several machines, that train one policy together. All of them hold
// the same state; what they exchange goes through here.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace agail {

using Bytes = std::vector<std::byte>;

// What this rank has sent so far, and how long it waited in exchanges.
struct Traffic {
  std::int64_t messages = 0;
  std::int64_t bytes = 0;
  double seconds = 0;

  Traffic& operator+=(const Traffic& other) {
    messages += other.messages;
    bytes += other.bytes;
    seconds += other.seconds;
    return *this;
  }
  friend Traffic operator-(const Traffic& a, const Traffic& b) {
    return {a.messages - b.messages, a.bytes - b.bytes, a.seconds - b.seconds};
  }
};

// Messages between two ranks arrive in the order in which they were sent. Called by one thread a
// rank. Everything else (collectives.h) is made of these three, so that its cost can be counted.
class Communicator {
 public:
  virtual ~Communicator() = default;
  Communicator() = default;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  virtual int rank() const = 0;
  virtual int ranks() const = 0;
  // For messages to people: "rank 3 on node7".
  virtual std::string name(int rank) const { return "rank " + std::to_string(rank); }

  void send(int to, std::span<const std::byte> message) {
    const Measure measure(traffic_, message.size());
    do_send(to, message);
  }
  // The content of `message` is replaced, its size becomes that of what came.
  void receive(int from, Bytes& message) {
    const Measure measure(traffic_);
    do_receive(from, message);
  }
  // Both at once, without waiting for one before the other.
  void exchange(int to, std::span<const std::byte> out, int from, Bytes& in) {
    const Measure measure(traffic_, out.size());
    do_exchange(to, out, from, in);
  }

  // Ends all ranks at once; for failures that the others do not know of.
  [[noreturn]] virtual void abort(int exit_code) = 0;

  const Traffic& traffic() const { return traffic_; }

 protected:
  virtual void do_send(int to, std::span<const std::byte> message) = 0;
  virtual void do_receive(int from, Bytes& message) = 0;
  virtual void do_exchange(int to, std::span<const std::byte> out, int from, Bytes& in) = 0;

 private:
  using Clock = std::chrono::steady_clock;
  struct Measure {
    explicit Measure(Traffic& t) : traffic(t) {}
    Measure(Traffic& t, std::size_t bytes) : traffic(t) {
      ++traffic.messages;
      traffic.bytes += static_cast<std::int64_t>(bytes);
    }
    ~Measure() { traffic.seconds += std::chrono::duration<double>(Clock::now() - start).count(); }
    Measure(const Measure&) = delete;
    Measure& operator=(const Measure&) = delete;
    Traffic& traffic;
    Clock::time_point start = Clock::now();
  };
  Traffic traffic_;
};

// The only rank there is.
class SerialCommunicator final : public Communicator {
 public:
  int rank() const override { return 0; }
  int ranks() const override { return 1; }
  [[noreturn]] void abort(int exit_code) override;

 private:
  void do_send(int to, std::span<const std::byte> message) override;
  void do_receive(int from, Bytes& message) override;
  void do_exchange(int to, std::span<const std::byte> out, int from, Bytes& in) override;
};

Communicator& no_other_ranks();

}  // namespace agail
