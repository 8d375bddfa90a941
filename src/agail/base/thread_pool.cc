#include "agail/base/thread_pool.h"

#include <string>
#include <system_error>
#include <utility>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "agail/base/error.h"

namespace agail {
namespace {

void pause() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

// Waits until `value` is no longer `old`: jobs follow each other closely, so a short spin (some
// microseconds) often saves the two system calls; then it sleeps and leaves the core to others.
template <class T>
void wait_while_equal(const std::atomic<T>& value, T old) {
  for (int spin = 0; spin < 500; ++spin) {
    if (value.load(std::memory_order_acquire) != old) return;
    pause();
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

ThreadPool::ThreadPool(int threads) {
  AGAIL_CHECK(threads >= 1);
  workers_.reserve(static_cast<std::size_t>(threads - 1));
  try {
    for (int worker = 1; worker < threads; ++worker)
      workers_.emplace_back([this, worker] { work(worker); });
  } catch (const std::system_error& error) {
    stopping_ = true;
    ++job_number_;
    job_number_.notify_all();
    for (std::thread& worker : workers_) worker.join();
    throw SystemError("cannot start " + std::to_string(threads) + " threads: " + error.what());
  }
}

ThreadPool::~ThreadPool() {
  stopping_ = true;
  ++job_number_;
  job_number_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::run_erased(int tasks, Call call, void* function) {
  if (tasks <= 0) return;
  AGAIL_CHECK(!running_.exchange(true));
  call_ = call;
  function_ = function;
  unfinished_.store(tasks, std::memory_order_relaxed);
  tickets_.store(static_cast<std::uint64_t>(tasks) << 32, std::memory_order_release);
  if (!workers_.empty() && tasks > 1) {
    job_number_.fetch_add(1, std::memory_order_release);
    job_number_.notify_all();
  }
  take_tasks(0);
  for (int left = 0; (left = unfinished_.load(std::memory_order_acquire)) != 0;)
    wait_while_equal(unfinished_, left);
  failed_task_ = kNoTask;
  running_ = false;
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void ThreadPool::work(int worker) {
  for (unsigned seen = 0;;) {
    wait_while_equal(job_number_, seen);
    seen = job_number_.load(std::memory_order_acquire);
    if (stopping_) return;
    take_tasks(worker);
  }
}

bool ThreadPool::take_task(int& task) {
  std::uint64_t tickets = tickets_.load(std::memory_order_acquire);
  for (;;) {
    const auto next = static_cast<std::uint32_t>(tickets);
    if (next >= tickets >> 32) return false;
    task = static_cast<int>(next);
    if (tickets_.compare_exchange_weak(tickets, tickets + 1, std::memory_order_acq_rel))
      return true;
  }
}

void ThreadPool::take_tasks(int worker) {
  int task = 0;
  while (take_task(task)) {
    try {
      // Which exception comes out must not depend on who was first, so a lower task is never left
      // out.
      if (task < failed_task_) call_(function_, task, worker);
    } catch (...) {
      const std::lock_guard lock(failure_mutex_);
      if (task < failed_task_) {
        failure_ = std::current_exception();
        failed_task_ = task;
      }
    }
    if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) == 1 && worker != 0)
      unfinished_.notify_one();
  }
}

}  // namespace agail
