#include "agail/base/crc32c.h"

#include <gtest/gtest.h>

#include <numeric>
#include <string_view>
#include <vector>

namespace agail {
namespace {

// RFC 3720, B.4 (bytes of the CRC are printed there in the order of transmission).
TEST(Crc32c, PublishedVectors) {
  std::vector<std::uint8_t> bytes(32, 0);
  EXPECT_EQ(crc32c(bytes), 0x8a9136aaU);
  bytes.assign(32, 0xff);
  EXPECT_EQ(crc32c(bytes), 0x62a8ab43U);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  EXPECT_EQ(crc32c(bytes), 0x46dd794eU);
  constexpr std::string_view digits = "123456789";
  bytes.assign(digits.begin(), digits.end());
  EXPECT_EQ(crc32c(bytes), 0xe3069283U);
  EXPECT_EQ(crc32c({}), 0U);
}

TEST(Crc32c, GoesOnWhereItEnded) {
  const std::vector<std::uint8_t> bytes = {1, 2, 3, 4, 5};
  EXPECT_EQ(crc32c(std::span(bytes).subspan(2), crc32c(std::span(bytes).first(2))), crc32c(bytes));
}

}  // namespace
}  // namespace agail
