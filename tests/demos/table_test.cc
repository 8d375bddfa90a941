#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/csv_table.h"
#include "agail/demos/npz_table.h"
#include "agail/demos/zip.h"
#include "npz_bytes.h"
#include "samples.h"

namespace agail {
namespace {

using testing::HasSubstr;

class Csv : public testing::Test {
 protected:
  Demonstrations read(const std::string& text) {
    write_file_atomically(folder_ / "t.csv", std::string_view(text));
    ignored_.clear();
    return demonstrations_from(read_csv(folder_ / "t.csv", ignored_), "Some-v0", std::nullopt);
  }
  std::string error(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "(no error)";
  }
  TemporaryFolder folder_;
  std::vector<std::string> ignored_;
};

TEST_F(Csv, TheLastRowOfAnEpisodeIsItsFinalState) {
  const Demonstrations all = read(
      "episode,obs_0,obs_1,action_0,reward,time\n"
      "3,0,1,0.5,1,12:00\n3,2,3,,1,12:01\n3,4,5,,,12:02\n"
      "4,0,1,0.25,2,12:00\r\n4,6,7,,,12:01\n");
  ASSERT_EQ(all.episodes.size(), 2U);
  EXPECT_EQ(all.episodes[0].steps(), 2);
  EXPECT_EQ(all.episodes[0].observations(2, 1), 5);
  EXPECT_EQ(all.episodes[0].available(0, 0), 1);
  EXPECT_EQ(all.episodes[0].available(1, 0), 0);
  EXPECT_TRUE(std::isnan(all.episodes[0].actions(1, 0)));
  EXPECT_EQ(all.mean_return(), 2);
  EXPECT_EQ(all.episodes[1].truncations.back(), 1);
  EXPECT_THAT(ignored_, testing::ElementsAre("time"));
}

TEST_F(Csv, WithNextObservationsEachRowIsAStep) {
  const Demonstrations all = read(
      "obs_0,action,next_obs_0,terminated\n"
      "0,1,1,0\n1,0,2,1\n5,1,6,0\n");
  ASSERT_EQ(all.episodes.size(), 2U);
  EXPECT_EQ(all.episodes[0].steps(), 2);
  EXPECT_EQ(all.episodes[0].observations(2, 0), 2);
  EXPECT_EQ(all.episodes[0].terminations.back(), 1);
  EXPECT_EQ(all.episodes[0].truncations.back(), 0);
  EXPECT_EQ(all.episodes[1].truncations.back(), 1);
  EXPECT_TRUE(all.action.discrete);
  EXPECT_EQ(all.action.n, 2);
}

TEST_F(Csv, SaysWhatIsWrong) {
  EXPECT_THAT(error("a,b\n1,2\n"), HasSubstr("obs_0"));
  EXPECT_THAT(error("obs_0,obs_2\n1,2\n"), HasSubstr("lacks some"));
  EXPECT_THAT(error("obs_0\n1\n1,2\n"), HasSubstr("row 1 has 2 cells"));
  EXPECT_THAT(error("obs_0\n1\nx\n"), HasSubstr("row 1, column obs_0"));
  EXPECT_THAT(error("obs_0\n1\nnan\n"), HasSubstr("row 1"));
  EXPECT_THAT(error("obs_0,reward\n1,1\n\n2,\n"), HasSubstr("(no error)"));
  EXPECT_THAT(error("obs_0,reward\n1,\n2,1\n"), HasSubstr("reward in row 0"));
  EXPECT_THAT(error("obs_0\n1\n"), HasSubstr("single row"));
  EXPECT_THAT(error("obs_0\n"), HasSubstr("no rows"));
  EXPECT_THAT(error(""), HasSubstr("obs_0"));
  EXPECT_THAT(error("episode,obs_0\n0,1\n0,2\n1,1\n1,2\n0,3\n"), HasSubstr("earlier episode"));
  EXPECT_THAT(error("episode,obs_0\n9007199254740992,1\n9007199254740993,2\n"),
              HasSubstr("0, 1, 2"));
  EXPECT_THAT(error("obs_0,action_0\n1,1\n2,1e39\n3,1\n"),
              HasSubstr("an action in row 1 is too large for float32"));
  EXPECT_THAT(error("obs_0\n2\n-1e39\n"),
              HasSubstr("an observation in row 1 is too large for float32"));
  EXPECT_THAT(error("obs_0,next_obs_0\n0,1\n5,6\n"), HasSubstr("not the observation of row 1"));
  EXPECT_THAT(error("episode,obs_0,terminated\n0,1,1\n0,2,0\n0,3,0\n"),
              HasSubstr("goes on after it"));
  EXPECT_THAT(error("obs_0,action,action_0\n0,1,1\n"), HasSubstr("one kind"));
}

TEST_F(Csv, ChecksTheKnownActionSpace) {
  write_file_atomically(folder_ / "t.csv", std::string_view("obs_0,action\n0,1\n1,\n"));
  const StepTable table = read_csv(folder_ / "t.csv", ignored_);
  const ActionSpace two{.discrete = true, .dim = 1, .n = 2, .low = {}, .high = {}};
  EXPECT_EQ(demonstrations_from(table, "E-v0", two).action.n, 2);
  const ActionSpace one{.discrete = true, .dim = 1, .n = 1, .low = {}, .high = {}};
  EXPECT_THROW(demonstrations_from(table, "E-v0", one), InputError);
  const ActionSpace box{.discrete = false, .dim = 2, .n = 0, .low = {0, 0}, .high = {1, 1}};
  EXPECT_THROW(demonstrations_from(table, "E-v0", box), InputError);
}

std::string doubles(const std::vector<double>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

class Npz : public Csv {
 protected:
  std::string npz_error(const std::string& bytes) {
    try {
      read_npz_bytes(bytes);
    } catch (const InputError& error) {
      return error.what();
    }
    return "(no error)";
  }
  Demonstrations read_npz_bytes(const std::string& bytes) {
    std::ofstream(folder_ / "t.npz", std::ios::binary) << bytes;
    return demonstrations_from(read_npz(folder_ / "t.npz", ignored_), "Some-v0", std::nullopt);
  }
};

TEST_F(Npz, ActionsMayLeaveOutTheFinalRows) {
  const Demonstrations all =
      read_npz_bytes(zip({{"observations.npy", npy("<f8", "(5, 1)", doubles({0, 1, 2, 3, 4}))},
                          {"actions.npy", npy("<f8", "(3, 1)", doubles({10, NAN, 13}))},
                          {"episode_ends.npy", npy("<f8", "(2,)", doubles({3, 5}))}}));
  ASSERT_EQ(all.episodes.size(), 2U);
  EXPECT_EQ(all.episodes[0].actions(0, 0), 10);
  EXPECT_EQ(all.episodes[0].available(1, 0), 0);
  EXPECT_EQ(all.episodes[1].actions(0, 0), 13);
  EXPECT_DOUBLE_EQ(all.missing_ratio(), 1.0 / 3);
}

TEST_F(Npz, TheMaskMayLeaveOutTheFinalRows) {
  const Demonstrations all =
      read_npz_bytes(zip({{"observations.npy", npy("<f8", "(5, 1)", doubles({0, 1, 2, 3, 4}))},
                          {"actions.npy", npy("<f8", "(3, 1)", doubles({10, 11, 13}))},
                          {"action_available.npy", npy("<f8", "(3,)", doubles({1, 0, 1}))},
                          {"episode_ends.npy", npy("<f8", "(2,)", doubles({3, 5}))}}));
  EXPECT_EQ(all.episodes[0].available(1, 0), 0);
  EXPECT_EQ(all.episodes[1].available(0, 0), 1);
}

TEST_F(Npz, SaysWhatIsWrong) {
  const auto observations = std::pair<std::string, std::string>{
      "observations.npy", npy("<f8", "(2, 1)", doubles({0, 1}))};
  EXPECT_THAT(npz_error(zip({observations})), HasSubstr("(no error)"));
  EXPECT_THAT(npz_error("hello"), HasSubstr("not a .npz"));
  EXPECT_THAT(npz_error(zip({})), HasSubstr("no array observations"));
  EXPECT_THAT(npz_error(zip({{"observations.npy", npy("<f8", "(3, 1)", doubles({0, 1}))}})),
              HasSubstr("size"));
  EXPECT_THAT(npz_error(zip({{"observations.npy", npy("<U1", "(2, 1)", doubles({0}))}})),
              HasSubstr("plain numbers"));
  EXPECT_THAT(npz_error(zip({{"observations.npy", npy(">f8", "(2, 1)", doubles({0, 1}))}})),
              HasSubstr("big-endian"));
  EXPECT_THAT(npz_error(zip({{"observations.npy", "x"}})), HasSubstr("not a numpy array"));
  const std::string long_shape = "(" + std::string(60000, '1') + ",)";
  EXPECT_THAT(npz_error(zip({{"observations.npy", npy("<f8", long_shape, doubles({0, 1}))}})),
              HasSubstr("damaged header"));
  EXPECT_THAT(
      npz_error(zip({observations, {"actions.npy", npy("<f8", "(5,)", doubles({0, 1, 2, 3, 4}))}})),
      HasSubstr("actions has 5 rows"));
  EXPECT_THAT(
      npz_error(zip({observations, {"episode_starts.npy", npy("<f8", "(1,)", doubles({9}))}})),
      HasSubstr("row numbers"));
  EXPECT_THAT(npz_error(zip({{"observations.npy", npy("<f8", "(0, 1)", "")}})),
              HasSubstr("no rows"));
  EXPECT_THAT(npz_error(zip({{"observations.npy", npy("<f8", "(2, 0)", "")}})),
              HasSubstr("without entries"));
  EXPECT_THAT(npz_error(zip({observations, {"rewards.npy", npy("<f8", "(0,)", "")}})),
              HasSubstr("rewards has 0 rows"));
  EXPECT_THAT(npz_error(zip({observations,
                             {"episodes.npy", npy("<f8", "(2,)", doubles({0, 0}))},
                             {"episode_starts.npy", npy("<f8", "(1,)", doubles({0}))}})),
              HasSubstr("more than one of"));
  const auto mask = [](const std::vector<double>& values) {
    return std::pair<std::string, std::string>{
        "action_available.npy",
        npy("<f8", "(" + std::to_string(values.size()) + ",)", doubles(values))};
  };
  const auto actions =
      std::pair<std::string, std::string>{"actions.npy", npy("<f8", "(2, 1)", doubles({0, 1}))};
  EXPECT_THAT(npz_error(zip({observations, actions, mask({1, NAN})})), HasSubstr("other than 0"));
  EXPECT_THAT(npz_error(zip({observations, mask({1, 2})})), HasSubstr("other than 0"));
  EXPECT_THAT(npz_error(zip({observations, mask({1, 1, 1, 1, 1})})),
              HasSubstr("action_available has 5 rows"));
}

TEST_F(Npz, SurvivesRandomDamage) {
  const std::string whole =
      zip({{"observations.npy", npy("<f8", "(5, 1)", doubles({0, 1, 2, 3, 4}))},
           {"actions.npy", npy("<f8", "(3, 1)", doubles({10, NAN, 13}))},
           {"episode_ends.npy", npy("<f8", "(2,)", doubles({3, 5}))}});
  for (std::uint32_t round = 0; round < 1000; ++round) {
    RandomStream random(3, Purpose::kDiagnostics, round);
    std::string bytes = whole;
    if (round % 4 == 0) bytes.resize(random.below(static_cast<std::uint32_t>(bytes.size())));
    for (std::uint32_t i = 0; i < 1 + round % 3 && !bytes.empty(); ++i)
      bytes[random.below(static_cast<std::uint32_t>(bytes.size()))] ^=
          static_cast<char>(1 << random.below(8));
    npz_error(bytes);
  }
}

}  // namespace
}  // namespace agail
