#include "agail/base/nearest.h"

#include <gtest/gtest.h>

#include <vector>

namespace agail {
namespace {

TEST(Nearest, FindsWhatWasMeant) {
  const std::vector<std::string> names = {"Hopper-v4", "Hopper-v5", "Humanoid-v4", "trpo.max_kl"};
  EXPECT_EQ(nearest("Hoper-v5", names), "Hopper-v5");
  EXPECT_EQ(nearest("humanoid", names), "Humanoid-v4");
  EXPECT_EQ(nearest("trpo.max_lk", names), "trpo.max_kl");
  EXPECT_EQ(nearest("Hopper", names), "Hopper-v4");  // the first of equals
  EXPECT_EQ(nearest("", names), "Hopper-v4");
  EXPECT_EQ(nearest("x", {}), "");
}

}  // namespace
}  // namespace agail
