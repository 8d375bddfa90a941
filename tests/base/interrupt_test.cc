#include "agail/base/interrupt.h"

#include <gtest/gtest.h>

#include <memory>

namespace agail {
namespace {

TEST(Interrupt, NotesTheFirstSignal) {
  {
    const InterruptGuard guard;
    EXPECT_EQ(interrupted(), 0);
    std::raise(SIGTERM);
    EXPECT_EQ(interrupted(), SIGTERM);
    std::raise(SIGINT);
    EXPECT_EQ(interrupted(), SIGTERM);
  }
  EXPECT_EQ(interrupted(), SIGTERM);  // still known when the work has been wound up
  const InterruptGuard guard;
  EXPECT_EQ(interrupted(), 0);
}

TEST(InterruptDeathTest, SecondSignalEndsTheProcess) {
  EXPECT_EXIT(
      {
        const InterruptGuard guard;
        std::raise(SIGINT);
        std::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
}

std::sig_atomic_t handled = 0;

TEST(Interrupt, SecondSignalGoesToTheHandlerThatWasThere) {
  const auto before = std::signal(SIGINT, [](int) { handled = 1; });
  {
    const InterruptGuard guard;
    std::raise(SIGINT);
    EXPECT_EQ(handled, 0);
    std::raise(SIGINT);
    EXPECT_EQ(handled, 1);
  }
  handled = 0;
  std::raise(SIGINT);
  EXPECT_EQ(handled, 1);
  std::signal(SIGINT, before);
}

TEST(Interrupt, GuardsOfSeveralThreadsShareIt) {
  auto first = std::make_unique<InterruptGuard>();
  auto second = std::make_unique<InterruptGuard>();
  EXPECT_TRUE(first->alone());
  EXPECT_FALSE(second->alone());
  std::raise(SIGTERM);
  first.reset();  // in the order in which they were built
  EXPECT_EQ(interrupted(), SIGTERM);
  second.reset();
  struct sigaction now {};
  sigaction(SIGTERM, nullptr, &now);
  EXPECT_EQ(now.sa_handler, SIG_DFL);
}

TEST(InterruptDeathTest, GuardRestoresWhatWasThere) {
  EXPECT_EXIT(
      {
        std::signal(SIGTERM, SIG_DFL);
        { const InterruptGuard guard; }
        std::raise(SIGTERM);
      },
      testing::KilledBySignal(SIGTERM), "");
}

}  // namespace
}  // namespace agail
