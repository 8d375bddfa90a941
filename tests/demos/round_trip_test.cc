#include <gmock/gmock.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): POSIX's, not C's
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/mask.h"
#include "agail/demos/minari_reader.h"
#include "agail/demos/minari_writer.h"
#include "base/messages.h"
#include "samples.h"

namespace agail {
namespace {

template <class T>
bool same_bits(const RowMatrix<T>& a, const RowMatrix<T>& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
  return a.size() == 0 ||
         std::memcmp(a.data(), b.data(), sizeof(T) * static_cast<std::size_t>(a.size())) == 0;
}

// NaN equals NaN.
bool same_values(const RowMatrix<double>& a, const RowMatrix<double>& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         ((a.array() == b.array()) || (a.array().isNaN() && b.array().isNaN())).all();
}

void expect_same(const Demonstrations& a, const Demonstrations& b) {
  EXPECT_EQ(a.environment, b.environment);
  EXPECT_EQ(a.action, b.action);
  EXPECT_EQ(a.observation_dim, b.observation_dim);
  EXPECT_EQ(a.observations_are_float32, b.observations_are_float32);
  EXPECT_EQ(a.actions_are_float32, b.actions_are_float32);
  EXPECT_EQ(a.pattern, b.pattern);
  ASSERT_EQ(a.episodes.size(), b.episodes.size());
  for (std::size_t i = 0; i < a.episodes.size(); ++i) {
    EXPECT_TRUE(same_bits(a.episodes[i].observations, b.episodes[i].observations));
    EXPECT_TRUE(same_values(a.episodes[i].actions, b.episodes[i].actions));
    EXPECT_TRUE(same_bits(a.episodes[i].available, b.episodes[i].available));
    EXPECT_EQ(a.episodes[i].rewards, b.episodes[i].rewards);
    EXPECT_EQ(a.episodes[i].terminations, b.episodes[i].terminations);
    EXPECT_EQ(a.episodes[i].truncations, b.episodes[i].truncations);
    EXPECT_EQ(a.episodes[i].seed, b.episodes[i].seed);
  }
}

std::vector<Demonstrations> all_samples() {
  std::vector<Demonstrations> samples = {sample({1, 30, 200}), discrete_sample({20, 9}),
                                         sample({5}, 1, 1)};
  for (const MaskPattern pattern :
       {MaskPattern::kStep, MaskPattern::kBlock, MaskPattern::kEpisode, MaskPattern::kDimension}) {
    samples.push_back(sample({50, 70}));
    remove_actions(samples.back(), {pattern, 0.5, 1, std::nullopt});
    if (pattern == MaskPattern::kDimension) continue;
    samples.push_back(discrete_sample({50, 70}));
    remove_actions(samples.back(), {pattern, 0.5, 1, std::nullopt});
  }
  samples.push_back(sample({10, 10}));
  for (DemoEpisode& episode : samples.back().episodes) episode.rewards.clear();
  samples.back().episodes[1].seed = 77;
  samples.back().environment = "";
  samples.push_back(sample({10}));
  samples.back().actions_are_float32 = false;
  samples.back().episodes[0].actions(0, 0) = 0.1;
  return samples;
}

TEST(RoundTrip, FileAndFolderGiveBackWhatWasWritten) {
  const TemporaryFolder folder;
  for (const Demonstrations& demonstrations : all_samples())
    for (const std::string name : {"a.hdf5", "dataset-v0"}) {
      write_demonstrations(demonstrations, folder / name);
      expect_same(read_demonstrations(folder / name), demonstrations);
    }
}

TEST(RoundTrip, EqualDemonstrationsGiveEqualBytes) {
  const TemporaryFolder folder;
  for (const Demonstrations& demonstrations : all_samples()) {
    const auto bytes = encode_demonstrations(demonstrations);
    EXPECT_EQ(bytes, encode_demonstrations(demonstrations));
    // What was read back is written as the same bytes, too, once the metadata went round.
    const Demonstrations once = read_demonstrations(bytes, "image");
    const auto again = encode_demonstrations(once);
    EXPECT_EQ(again, encode_demonstrations(read_demonstrations(again, "image")));
  }
}

TEST(RoundTrip, WithoutActionsAllAreMissing) {
  Demonstrations demonstrations = sample({10}, 3);
  demonstrations.action = ActionSpace{};
  demonstrations.episodes[0].actions.resize(10, 0);
  demonstrations.episodes[0].available.resize(10, 0);
  EXPECT_EQ(demonstrations.missing_ratio(), 1);
  expect_same(read_demonstrations(encode_demonstrations(demonstrations), "image"), demonstrations);
}

TEST(RoundTrip, MetadataOfTheSourceIsKept) {
  Demonstrations demonstrations = sample({10});
  demonstrations.environment = "ALE/Thing-v3";
  demonstrations.metadata =
      R"({"author": ["A. Uthor"], "algorithm_name": "TRPO", "env_spec": "{\"id\": \"ALE/Thing-v3\", \"kwargs\": {\"x\": 1}}"})";
  const TemporaryFolder folder;
  for (const std::string name : {"a.hdf5", "dataset"}) {
    write_demonstrations(demonstrations, folder / name);
    const Demonstrations read = read_demonstrations(folder / name);
    EXPECT_EQ(read.environment, "ALE/Thing-v3");
    EXPECT_THAT(read.metadata, testing::HasSubstr(R"("author":["A. Uthor"])"));
    EXPECT_THAT(read.metadata, testing::HasSubstr("TRPO"));
    EXPECT_THAT(read.metadata, testing::HasSubstr("kwargs"));
  }
}

TEST(RoundTrip, NotesGoThroughAnyNumberOfFiles) {
  Demonstrations demonstrations = sample({10});
  demonstrations.metadata =
      R"({"author": ["A. Uthor"], "note": "mine", "ref_max_score": 3234.5, "year": 2024, )"
      R"("approved": true, "largest": 18446744073709551615})";
  const TemporaryFolder folder;
  for (const std::string name : {"a.hdf5", "b.hdf5", "dataset", "c.hdf5"}) {
    write_demonstrations(demonstrations, folder / name);
    demonstrations = read_demonstrations(folder / name);
    for (const char* kept :
         {R"("author":["A. Uthor"])", R"("note":"mine")", R"("ref_max_score":3234.5)",
          R"("year":2024)", R"("approved":true)", R"("largest":18446744073709551615)"})
      EXPECT_THAT(demonstrations.metadata, testing::HasSubstr(kept));
  }
}

TEST(RoundTrip, KeysThatAFileCannotKeepAreNamed) {
  const TemporaryFolder folder;
  Demonstrations demonstrations = sample({10});
  for (const std::string& key : {std::string(), std::string(70000, 'k')}) {
    demonstrations.metadata = R"({")" + key + R"(": "x"})";
    const std::string told =
        input_error([&] { write_demonstrations(demonstrations, folder / "a.hdf5"); });
    EXPECT_THAT(told, testing::HasSubstr("\"" + key.substr(0, 40) + "\""));
    EXPECT_LT(told.size(), 200U);
    write_demonstrations(demonstrations, folder / "dataset");
  }
}

TEST(RoundTrip, AnEmptySpecIsNone) {
  Demonstrations demonstrations = sample({10});
  demonstrations.metadata = R"({"env_spec": ""})";
  EXPECT_EQ(read_demonstrations(encode_demonstrations(demonstrations), "image").environment,
            "Hopper-v5");
}

TEST(RoundTrip, AnEmptyMinariPathIsNone) {
  const TemporaryFolder folder;
  setenv("MINARI_DATASETS_PATH", "", 1);
  EXPECT_NO_THROW(write_demonstrations(sample({10}), folder / "d"));
  unsetenv("MINARI_DATASETS_PATH");
}

TEST(RoundTrip, DatasetsAreFoundByTheirId) {
  const TemporaryFolder folder;
  setenv("MINARI_DATASETS_PATH", (folder / "").c_str(), 1);
  write_demonstrations(sample({10}), folder / "hopper/partial-v0");
  EXPECT_EQ(read_demonstrations("hopper/partial-v0").transitions(), 10);
  EXPECT_THAT(read_demonstrations("hopper/partial-v0").metadata,
              testing::HasSubstr(R"("hopper/partial-v0")"));
  EXPECT_THROW(read_demonstrations("hopper/absent-v0"), InputError);
  write_demonstrations(sample({10}), folder / "hopper/slash-v0/");
  EXPECT_THAT(read_demonstrations("hopper/slash-v0").metadata,
              testing::HasSubstr(R"("hopper/slash-v0")"));
  EXPECT_THROW(write_demonstrations(sample({10}), folder / "unversioned"), InputError);
  unsetenv("MINARI_DATASETS_PATH");
}

TEST(RoundTrip, ReplacesDatasetsAndNothingElse) {
  const TemporaryFolder folder;
  write_demonstrations(sample({10}), folder / "d");
  write_demonstrations(sample({20}), folder / "d/");
  EXPECT_EQ(read_demonstrations(folder / "d").transitions(), 20);
  write_demonstrations(sample({10}), folder / "f.hdf5");
  write_demonstrations(sample({20}), folder / "f.hdf5");
  EXPECT_EQ(read_demonstrations(folder / "f.hdf5").transitions(), 20);

  std::filesystem::create_directory(folder / "precious");
  std::ofstream(folder / "precious/thesis.tex") << "x";
  EXPECT_THROW(write_demonstrations(sample({10}), folder / "precious"), InputError);
  std::filesystem::create_directories(folder / "project/data");
  for (const char* name : {"metadata.json", "main_data.hdf5", "mine.hdf5"}) {
    std::ofstream(folder / ("project/data/" + std::string(name))) << "x";
    if (name == std::string("main_data.hdf5")) continue;  // these two alone are a dataset
    EXPECT_THROW(write_demonstrations(sample({10}), folder / "project"), InputError);
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "project/data/mine.hdf5"));
  std::ofstream(folder / "d/notes.txt") << "x";
  EXPECT_THROW(write_demonstrations(sample({10}), folder / "d"), InputError);
  for (const char* name : {"precious/thesis.tex", "precious/thesis.tex/"})
    EXPECT_THROW(write_demonstrations(sample({10}), folder / name), InputError);
  EXPECT_EQ(read_file(folder / "precious/thesis.tex"), std::vector<std::uint8_t>{'x'});
  std::filesystem::create_directory(folder / "g.hdf5");
  EXPECT_THROW(write_demonstrations(sample({10}), folder / "g.hdf5"), InputError);
  EXPECT_THROW(write_demonstrations(sample({10}), "/proc/none/f.hdf5"), InputError);
  EXPECT_THROW(write_demonstrations(sample({10}), "/proc/none/folder"), InputError);
  for (const auto& entry : std::filesystem::directory_iterator(folder / ""))
    EXPECT_THAT(entry.path().string(), testing::Not(testing::HasSubstr(".tmp")));
}

TEST(RoundTrip, NamesMayBeAsLongAsTheyCanBe) {
  const TemporaryFolder folder;
  for (const std::string ending : {"", ".hdf5"}) {
    write_demonstrations(sample({10}), folder / (std::string(250, 'x') + ending));
    EXPECT_EQ(read_demonstrations(folder / (std::string(250, 'x') + ending)).transitions(), 10);
    EXPECT_THAT(input_error([&] {
                  write_demonstrations(sample({10}), folder / (std::string(256, 'x') + ending));
                }),
                testing::HasSubstr("File name too long"));
  }
}

TEST(RoundTrip, OutputsAreCheckedWithoutCreatingAnything) {
  const TemporaryFolder folder;
  for (const char* name : {"d", "d/", "new/d", "f.hdf5", "new/f.hdf5"}) check_output(folder / name);
  EXPECT_TRUE(std::filesystem::is_empty(folder / ""));
  std::ofstream(folder / "file") << "x";
  std::filesystem::create_directories(folder / "g.hdf5/other");
  for (const char* name : {"file", "file/", "file/d", "file/f.hdf5", "g.hdf5", "g.hdf5/"})
    EXPECT_THROW(check_output(folder / name), InputError) << name;
}

[[noreturn]] void write_on_a_full_disk(const std::string& path) {
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{20000, 20000};
  ::setrlimit(RLIMIT_FSIZE, &limit);
  try {
    write_demonstrations(sample({3000}), path);
  } catch (const SystemError& error) {
    std::cerr << error.what();
    std::exit(1);  // and not a crash there
  }
  std::exit(0);
}

TEST(RoundTrip, AFullDiskLeavesWhatWasThere) {
  const TemporaryFolder folder;
  for (const std::string name : {"d.hdf5", "d"}) {
    write_demonstrations(sample({10}), folder / name);
    EXPECT_EXIT(write_on_a_full_disk(folder / name), testing::ExitedWithCode(1),
                "cannot write .*agail-demos-.*disk full");
    EXPECT_EQ(read_demonstrations(folder / name).transitions(), 10);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / ""), {}), 2);
}

TEST(RoundTrip, FilesAreSmall) {
  Demonstrations demonstrations = sample({1000}, 3, 11);
  remove_actions(demonstrations, {MaskPattern::kStep, 0.5, 0, std::nullopt});
  const std::size_t plain = 1001 * 11 * 8 + 1000 * 3 * 4;
  EXPECT_LT(encode_demonstrations(demonstrations).size(), plain + 4096);
}

}  // namespace
}  // namespace agail
