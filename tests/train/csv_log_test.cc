#include "agail/train/csv_log.h"

#include <array>
#include <cmath>
#include <limits>

#include "agail/base/atomic_file.h"
#include "base/messages.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

using testing::HasSubstr;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string text(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  return {bytes.begin(), bytes.end()};
}

const std::vector<std::string> kColumns = {"time/total_timesteps", "rollout/ep_rew_mean"};

TEST(CsvLog, ShortestNumbersAndEmptyCells) {
  const TemporaryFolder folder;
  const auto path = folder / "progress.csv";
  CsvLog csv(path, kColumns);
  csv.row(std::array{1000000.0, 0.1});
  csv.row(std::array{2000000.0, kNone});
  csv.row(std::array{-0.0, 1.0 / 3});
  csv.row(std::array{1e300, -std::numeric_limits<double>::infinity()});
  EXPECT_EQ(text(path),
            "time/total_timesteps,rollout/ep_rew_mean\n"
            "1000000,0.1\n2000000,\n0,0.3333333333333333\n1e+300,-inf\n");
}

TEST(CsvLog, GoesOnAndRefusesOtherColumns) {
  const TemporaryFolder folder;
  const auto path = folder / "progress.csv";
  CsvLog(path, kColumns).row(std::array{1.0, 2.0});
  CsvLog(path, kColumns).row(std::array{3.0, 4.0});
  EXPECT_EQ(text(path), "time/total_timesteps,rollout/ep_rew_mean\n1,2\n3,4\n");
  EXPECT_THAT(input_error([&] { CsvLog(path, {"other"}); }), HasSubstr("its columns are not"));
  write_file_atomically(path, "time/total_times");  // the header was cut short
  CsvLog(path, kColumns).row(std::array{1.0, 2.0});
  EXPECT_EQ(text(path), "time/total_timesteps,rollout/ep_rew_mean\n1,2\n");
}

TEST(CsvLog, TruncatesToTheCheckpoint) {
  const TemporaryFolder folder;
  const auto path = folder / "progress.csv";
  const std::string header = "time/total_timesteps,rollout/ep_rew_mean\n";
  write_file_atomically(path, header + "1024,1\n2048,\n3072,3\n40");
  CsvLog csv(path, kColumns);
  csv.truncate_after("time/total_timesteps", 2048);
  EXPECT_EQ(text(path), header + "1024,1\n2048,\n");
  csv.row(std::array{3072.0, 5.0});
  csv.truncate_after("time/total_timesteps", 1e9);
  EXPECT_EQ(text(path), header + "1024,1\n2048,\n3072,5\n");
  csv.truncate_after("time/total_timesteps", 0);
  EXPECT_EQ(text(path), header);
  write_file_atomically(path, header + "1,2\nfoo,3\n");
  EXPECT_THAT(input_error([&] { csv.truncate_after("time/total_timesteps", 5); }),
              HasSubstr("progress.csv:3: "));
}

}  // namespace
}  // namespace agail
