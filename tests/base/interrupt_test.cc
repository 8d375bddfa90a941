#include "agail/base/interrupt.h"

#include <gtest/gtest.h>

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
