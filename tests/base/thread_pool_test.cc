#include "agail/base/thread_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace agail {
namespace {

TEST(ThreadPool, RunsEveryTaskOnce) {
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (const int tasks : {0, 1, 2, 7, 1000}) {
      std::vector<int> count(static_cast<std::size_t>(tasks), 0);
      pool.run(tasks, [&](int task, int worker) {
        EXPECT_GE(worker, 0);
        EXPECT_LT(worker, threads);
        ++count[static_cast<std::size_t>(task)];  // a task is one worker's alone: no lock
      });
      EXPECT_EQ(count, std::vector<int>(static_cast<std::size_t>(tasks), 1));
    }
  }
}

TEST(ThreadPool, ManySmallRunsSeeEachOthersResults) {
  ThreadPool pool(4);
  std::array<std::int64_t, 5> now{}, before{};
  for (int run = 0; run < 2000; ++run) {
    before = now;
    // Every task reads what another wrote in the run before.
    pool.run(5, [&](int task, int) {
      now.at(static_cast<std::size_t>(task)) =
          before.at(static_cast<std::size_t>((task + 1) % 5)) + task;
    });
  }
  // In 2000 runs each chain passes every task 400 times.
  for (const std::int64_t value : now) EXPECT_EQ(value, 400 * (0 + 1 + 2 + 3 + 4));
}

TEST(ThreadPool, RethrowsTheLowestTasksExceptionAndGoesOn) {
  for (const int threads : {1, 3}) {
    ThreadPool pool(threads);
    std::vector<int> count(40);
    const auto fail = [&](int task, int) {
      ++count[static_cast<std::size_t>(task)];
      if (task % 10 == 3) throw std::runtime_error("task " + std::to_string(task));
    };
    for (int round = 0; round < 50; ++round) {
      std::fill(count.begin(), count.end(), 0);
      try {
        pool.run(40, fail);
        FAIL();
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "task 3");
      }
      for (std::size_t task = 0; task < count.size(); ++task)
        EXPECT_TRUE(count[task] == 1 || (task > 3 && count[task] == 0)) << task;
    }
    std::atomic<int> ran = 0;
    pool.run(10, [&](int, int) { ++ran; });
    EXPECT_EQ(ran, 10);
  }
}

TEST(ThreadPool, LeavesOutTheTasksAboveAFailure) {
  ThreadPool pool(1);
  int ran = 0;
  const auto fail = [&](int task, int) {
    ++ran;
    if (task == 2) throw std::runtime_error("no");
  };
  EXPECT_THROW(pool.run(1000, fail), std::runtime_error);
  EXPECT_EQ(ran, 3);
}

TEST(ThreadPool, ATaskBelowAFailureHasTheLastWord) {
  ThreadPool pool(2);
  std::atomic<bool> failing = false;
  try {
    pool.run(2, [&](int task, int) {
      if (task == 0) failing.wait(false);  // the other one fails first, or at once with it
      failing = true;
      failing.notify_all();
      throw std::runtime_error("task " + std::to_string(task));
    });
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "task 0");
  }
}

TEST(ThreadPool, RefusesARunInsideATask) {
  ThreadPool pool(2);
  EXPECT_THROW(pool.run(4, [&](int, int) { pool.run(2, [](int, int) {}); }), std::logic_error);
}

TEST(ThreadPool, TakesConstFunctions) {
  ThreadPool pool(2);
  std::atomic<int> sum = 0;
  const auto add = [&](int task, int) { sum += task; };
  pool.run(5, add);
  EXPECT_EQ(sum, 10);
}

}  // namespace
}  // namespace agail
