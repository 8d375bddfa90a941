#include "agail/train/tensorboard.h"

#include <array>
#include <cmath>
#include <vector>

#include "agail/base/atomic_file.h"
#include "base/messages.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

using Point = std::pair<std::string_view, double>;

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

// Records without their times and checksums, which TensorBoard's own reader checks in
// test_files.py.
std::vector<std::string> records(const TensorBoardWriter& writer) {
  const std::vector<std::uint8_t> bytes = read_file(writer.path());
  std::vector<std::string> out;
  for (std::size_t at = 0; at < bytes.size(); at += bytes[at] + 16U)
    out.push_back(hex(std::span(bytes).subspan(at + 12 + 9, bytes[at] - 9U)));
  return out;
}

TEST(TensorBoard, Bytes) {
  const TemporaryFolder folder;
  TensorBoardWriter writer(folder.path());
  writer.scalars(300, std::array{Point{"a/b", 1.0}, Point{"gone", std::nan("")}, Point{"c", -2.0}});
  writer.scalars(301, std::array{Point{"gone", std::nan("")}});
  writer.flush();
  const std::vector<std::string> expected = {
      "1a0d"
      "627261696e2e4576656e743a32",  // file_version "brain.Event:2"
      "10ac02"
      "2a16"
      "0a0a"
      "0a03612f62"
      "150000803f"
      "0a08"
      "0a0163"
      "15000000c0"};
  EXPECT_EQ(records(writer), expected);
}

TEST(TensorBoard, AResumedRunPurgesLaterSteps) {
  const TemporaryFolder folder;
  const TensorBoardWriter first(folder.path());
  const TensorBoardWriter second(folder.path(), 300);
  EXPECT_LT(first.path(), second.path());
  EXPECT_EQ(records(second).at(1),
            "10ad02"
            "3a020801");  // step 301, SessionLog START
}

TEST(TensorBoard, SystemErrors) {
  const TemporaryFolder folder;
  EXPECT_THROW(TensorBoardWriter(folder / "none"), SystemError);
}

}  // namespace
}  // namespace agail
