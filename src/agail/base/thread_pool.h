// Threads for work that is cut into numbered tasks. Which worker takes which task is left to
// chance, so results must depend on the task's number only (see design: exactness).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

#include "agail/base/cpu_quota.h"  // default_threads()

namespace agail {

class ThreadPool {
 public:
  explicit ThreadPool(int threads);  // >= 1, the caller of run() included
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  // Calls f(task, worker) once for each task in [0, tasks), worker in [0, threads()), and returns
  // when all are done. Does not allocate. Once a task has thrown, those above it that have not
  // begun are left out, those below it still run, and the exception of the lowest task is thrown
  // here. One run at a time, and none from inside a task.
  template <class F>
  void run(int tasks, F&& f) {
    using Function = std::remove_reference_t<F>;
    run_erased(
        tasks,
        [](void* function, int task, int worker) {
          (*static_cast<Function*>(function))(task, worker);
        },
        const_cast<void*>(static_cast<const void*>(std::addressof(f))));
  }

  // Calls f(first, count) for blocks of `block` numbers that make up [0, n), as one task a thread:
  // for work so light that handing out the blocks one by one would cost more.
  template <class F>
  void run_blocks(std::ptrdiff_t n, std::ptrdiff_t block, F&& f) {
    const std::ptrdiff_t blocks = (n + block - 1) / block;
    const auto tasks = static_cast<int>(std::min<std::ptrdiff_t>(threads(), blocks));
    run(tasks, [&](int task, int) {
      const std::ptrdiff_t end = blocks * (task + 1) / tasks;
      for (std::ptrdiff_t b = blocks * task / tasks; b < end; ++b)
        f(b * block, std::min(block, n - b * block));
    });
  }

 private:
  using Call = void (*)(void* function, int task, int worker);

  void run_erased(int tasks, Call call, void* function);
  void work(int worker);
  void take_tasks(int worker);
  bool take_task(int& task);

  // The job. Written by run() before `tickets_` offers its tasks; whoever took a task may read it,
  // since run() returns only when every task that was taken is done.
  Call call_ = nullptr;
  void* function_ = nullptr;

  // Tasks on offer: how many the job has (high half) and which is next (low half), in one word, so
  // that a worker who wakes up late finds either a task of the job under way or none. run() never
  // waits for a worker that has taken nothing: on a busy machine that would be a time slice.
  alignas(64) std::atomic<std::uint64_t> tickets_{0};
  alignas(64) std::atomic<int> unfinished_{0};
  alignas(64) std::atomic<unsigned> job_number_{0};  // what idle workers wait for
  std::atomic<bool> stopping_{false};
  std::atomic<bool> running_{false};

  static constexpr int kNoTask = std::numeric_limits<int>::max();
  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  std::atomic<int> failed_task_{kNoTask};  // the lowest; written with the mutex held

  std::vector<std::thread> workers_;
};

}  // namespace agail
