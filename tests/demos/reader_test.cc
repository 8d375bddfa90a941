#include "agail/demos/minari_reader.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>

#include "agail/base/atomic_file.h"
#include "agail/base/error.h"
#include "agail/demos/hdf5.h"
#include "agail/demos/mask.h"
#include "agail/demos/minari_writer.h"
#include "samples.h"

// HDF5 1.10 forgets some of its own memory when it gives up on a damaged file.
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libhdf5";
}

namespace agail {
namespace {

using hdf5::Group;
using hdf5::Type;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// One episode, T = 3, two observations, two actions; each test changes something.
struct Plain {
  std::vector<double> observations = {0, 1, 2, 3, 4, 5, 6, 7};
  std::vector<std::size_t> observation_shape = {4, 2};
  std::vector<double> actions = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  std::vector<std::size_t> action_shape = {3, 2};
  bool write_actions = true;
  std::vector<double> rewards = {1, 1, 1};
  std::vector<double> terminations = {0, 0, 1};
  std::vector<std::uint8_t> mask;
  std::vector<std::size_t> mask_shape = {4};
  std::string group = "episode_0";
  std::function<void(Group&)> root = [](Group&) {};
  std::function<void(Group&)> episode = [](Group&) {};

  void write_into(Group& file) const {
    Group here = file.create_group(group);
    here.write("observations", observation_shape, Type::kFloat64, observations.data());
    if (write_actions) here.write("actions", action_shape, Type::kFloat64, actions.data());
    if (!rewards.empty()) here.write("rewards", {rewards.size()}, Type::kFloat64, rewards.data());
    if (!terminations.empty())
      here.write("terminations", {terminations.size()}, Type::kFloat64, terminations.data());
    if (!mask.empty())
      here.create_group("infos").write("action_available", mask_shape, Type::kUint8, mask.data());
    episode(here);
  }

  Demonstrations read() const {
    hdf5::File file = hdf5::File::create_temporary();
    root(file.root());
    write_into(file.root());
    return read_demonstrations(file.close_and_take(), "demos.hdf5");
  }

  std::string error() const {
    try {
      read();
    } catch (const InputError& error) {
      return error.what();
    }
    return "(no error)";
  }
};

std::function<void(Group&)> with_attribute(const std::string& name, const std::string& text) {
  return [=](Group& group) { group.write_attribute(name, text); };
}

TEST(Reader, ReadsThePlainestFile) {
  const Demonstrations demonstrations = Plain{}.read();
  EXPECT_EQ(demonstrations.transitions(), 3);
  EXPECT_EQ(demonstrations.missing_ratio(), 0);
  EXPECT_EQ(demonstrations.mean_return(), 3);
  EXPECT_EQ(demonstrations.action.dim, 2);
  EXPECT_FALSE(demonstrations.action.discrete);
  EXPECT_EQ(demonstrations.environment, "");
  EXPECT_FALSE(demonstrations.actions_are_float32);
}

TEST(Reader, NaNIsMissing) {
  Plain plain;
  plain.actions[1] = kNaN;
  const Demonstrations demonstrations = plain.read();
  EXPECT_DOUBLE_EQ(demonstrations.missing_ratio(), 1.0 / 6);
  EXPECT_EQ(demonstrations.episodes[0].available(0, 0), 1);
  EXPECT_EQ(demonstrations.episodes[0].available(0, 1), 0);
}

TEST(Reader, TheMaskRulesOverNumbers) {
  Plain plain;
  plain.mask = {1, 0, 1, 0};
  EXPECT_DOUBLE_EQ(plain.read().missing_ratio(), 1.0 / 3);
  EXPECT_TRUE(std::isnan(plain.read().episodes[0].actions(1, 0)));
  plain.mask = {1, 0, 1, 1};  // the last row belongs to no action
  EXPECT_DOUBLE_EQ(plain.read().missing_ratio(), 1.0 / 3);
  plain.mask = {1, 0, 1};
  plain.mask_shape = {3};
  EXPECT_DOUBLE_EQ(plain.read().missing_ratio(), 1.0 / 3);
  plain.mask = {1, 0, 1, 1, 0, 0, 0, 0};
  plain.mask_shape = {4, 2};
  EXPECT_DOUBLE_EQ(plain.read().missing_ratio(), 0.5);
}

TEST(Reader, WithoutActionsAllAreMissing) {
  Plain plain;
  plain.write_actions = false;
  EXPECT_EQ(plain.read().missing_ratio(), 1);
  EXPECT_EQ(plain.read().action.dim, 0);
  plain.root = with_attribute(
      "action_space", R"({"type": "Box", "shape": [2], "low": [-Infinity, -1], "high": 1.0})");
  EXPECT_EQ(plain.read().action.dim, 2);
  EXPECT_EQ(plain.read().missing_ratio(), 1);
  // Some episodes with, some without.
  plain.root = [](Group& root) {
    Plain other;
    other.group = "episode_7";
    other.write_into(root);
  };
  EXPECT_DOUBLE_EQ(plain.read().missing_ratio(), 0.5);
}

TEST(Reader, RewardsAndFlagsAreOptional) {
  Plain plain;
  plain.rewards.clear();
  plain.terminations.clear();
  const Demonstrations demonstrations = plain.read();
  EXPECT_FALSE(demonstrations.has_rewards());
  EXPECT_EQ(demonstrations.episodes[0].truncations.back(), 1);
}

TEST(Reader, IntegersInOneColumnAreDiscrete) {
  Plain plain;
  plain.write_actions = false;
  plain.episode = [](Group& episode) {
    const std::int64_t actions[] = {0, 2, 1};
    episode.write("actions", {3}, Type::kInt64, actions);
  };
  EXPECT_TRUE(plain.read().action.discrete);
  EXPECT_EQ(plain.read().action.n, 3);
  plain.mask = {1, 0, 1, 0};  // a 2 that stands in for a missing action
  EXPECT_EQ(plain.read().action.n, 2);
  plain.mask.clear();
  plain.root = with_attribute("action_space", R"({"type": "Discrete", "n": 2, "start": 0})");
  EXPECT_THAT(plain.error(), AllOf(HasSubstr("episode_0/actions"), HasSubstr("from 0 to 1")));
}

TEST(Reader, DiscreteObservationsBecomeOneHot) {
  Plain plain;
  plain.observation_shape = {4};
  plain.observations = {1, 3, 2, 1};
  plain.root = with_attribute("observation_space", R"({"type": "Discrete", "n": 3, "start": 1})");
  RowMatrix<double> expected(4, 3);
  expected << 1, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 0;
  const Demonstrations once = plain.read();
  EXPECT_EQ(once.observation_dim, 3);
  EXPECT_EQ(once.episodes[0].observations, expected);
  const Demonstrations twice = read_demonstrations(encode_demonstrations(once), "again");
  EXPECT_EQ(twice.episodes[0].observations, expected);
  EXPECT_THAT(twice.metadata, HasSubstr(R"(\"Box\", \"dtype\": \"float32\", \"shape\": [3])"));
  plain.observations[1] = 4;
  EXPECT_THAT(plain.error(),
              AllOf(HasSubstr("episode_0/observations: row 1 has 4"), HasSubstr("from 1 to 3")));
}

TEST(Reader, BracketsInTextsAreNotNested) {
  Plain plain;
  plain.root = with_attribute(
      "env_spec", R"({"id": "Hopper-v5", "note": "\")" + std::string(150, '[') + R"("})");
  EXPECT_EQ(plain.read().environment, "Hopper-v5");
}

TEST(Reader, ArraysBesideTheEpisodesAreIgnored) {
  Plain plain;
  plain.root = [](Group& root) {
    const double lengths[] = {3};
    root.write("episode_lengths", {1}, Type::kFloat64, lengths);
    root.create_group("trajectory_-1");
    root.create_group("episode_metadata");
  };
  EXPECT_EQ(plain.read().transitions(), 3);
}

TEST(Reader, AnObservationSpaceThatIsNoJsonIsReplaced) {
  Plain plain;
  plain.root = with_attribute("observation_space", "Box(-inf, inf, (2,), float64)");
  EXPECT_THAT(read_demonstrations(encode_demonstrations(plain.read()), "again").metadata,
              HasSubstr(R"(\"type\": \"Box\")"));
}

// Each message says what and where.
TEST(Reader, RefusesWhatDoesNotFit) {
  const auto broken = [](const std::function<void(Plain&)>& change) {
    Plain plain;
    change(plain);
    std::string error = plain.error();
    EXPECT_THAT(error, AllOf(HasSubstr("demos.hdf5"), Not(HasSubstr("\n"))));
    return error;
  };
  EXPECT_THAT(broken([](Plain& p) { p.observations[3] = kNaN; }),
              HasSubstr("episode_0/observations"));
  EXPECT_THAT(broken([](Plain& p) { p.observations[3] = HUGE_VAL; }),
              HasSubstr("episode_0/observations"));
  EXPECT_THAT(broken([](Plain& p) { p.actions[3] = HUGE_VAL; }), HasSubstr("episode_0/actions"));
  EXPECT_THAT(broken([](Plain& p) { p.observations[3] = -1e39; }),
              HasSubstr("episode_0/observations: a number in row 1 is too large for float32"));
  EXPECT_THAT(broken([](Plain& p) { p.actions[3] = 1e39; }),
              HasSubstr("episode_0/actions: a number in row 1 is too large for float32"));
  EXPECT_THAT(broken([](Plain& p) { p.rewards[1] = kNaN; }), HasSubstr("episode_0/rewards"));
  EXPECT_THAT(broken([](Plain& p) { p.rewards.push_back(1); }), HasSubstr("expected (3)"));
  EXPECT_THAT(broken([](Plain& p) { p.terminations[1] = 0.5; }),
              HasSubstr("episode_0/terminations"));
  EXPECT_THAT(broken([](Plain& p) {
                p.observation_shape = {3, 2};
              }),
              HasSubstr("one more observation"));
  EXPECT_THAT(broken([](Plain& p) { p.observation_shape = {1, 2}; }), HasSubstr("no step"));
  EXPECT_THAT(broken([](Plain& p) { p.observation_shape = {2, 2, 2}; }), HasSubstr("flatten"));
  EXPECT_THAT(broken([](Plain& p) { p.mask = {1, 2, 1, 0}; }), HasSubstr("infos/action_available"));
  EXPECT_THAT(broken([](Plain& p) {
                p.mask = {1, 0, 1, 0, 0};
                p.mask_shape = {5};
              }),
              HasSubstr("expected 4 rows"));
  EXPECT_THAT(broken([](Plain& p) {
                p.mask = {1, 1, 1, 0};
                p.actions[2] = kNaN;
              }),
              HasSubstr("step 1, where the action is NaN"));
  EXPECT_THAT(broken([](Plain& p) { p.group = "trajectory_0"; }),
              AllOf(HasSubstr("no episodes"), Not(HasSubstr("D4RL"))));
  EXPECT_THAT(broken([](Plain& p) {
                p.group = "infos";
                p.root = [](Group& r) {
                  const std::vector<double> flat(8, 0.5);
                  r.write("observations", {4, 2}, Type::kFloat64, flat.data());
                };
              }),
              HasSubstr("from_d4rl()"));
  EXPECT_THAT(broken([](Plain& p) {
                p.root = [](Group& r) { r.write_attribute("total_episodes", std::int64_t{3}); };
              }),
              HasSubstr("3 episodes"));
  EXPECT_THAT(broken([](Plain& p) { p.root = with_attribute("total_episodes", "\xff\xfe"); }),
              HasSubstr("says there are"));
  for (const char* name : {"episode_-1", "episode_99999999999999999999999", "episode_"})
    EXPECT_THAT(broken([&](Plain& p) { p.root = [=](Group& r) { r.create_group(name); }; }),
                HasSubstr(std::string(name) + " is no episode number"));
  EXPECT_THAT(broken([](Plain& p) { p.root = with_attribute("env_spec", "{"); }),
              HasSubstr("env_spec"));
  EXPECT_THAT(broken([](Plain& p) {
                p.root = with_attribute("action_space", R"({"type": "Dict", "subspaces": {}})");
              }),
              HasSubstr("only Box and Discrete"));
  EXPECT_THAT(broken([](Plain& p) {
                p.root =
                    with_attribute("observation_space", R"({"type": "Discrete", "n": 9999999})");
              }),
              HasSubstr("n from 1 to 65536"));
  EXPECT_THAT(broken([](Plain& p) {
                p.episode = [](Group& e) {
                  const std::uint8_t mask[] = {1, 0, 1, 0};
                  e.write("infos", {4}, Type::kUint8, mask);
                };
              }),
              HasSubstr("episode_0/infos is a link or no group"));
  EXPECT_THAT(broken([](Plain& p) {
                p.root = with_attribute("action_space", R"({"type": "Discrete", "n": 2})");
              }),
              HasSubstr("the action space of the file 1"));
  EXPECT_THAT(broken([](Plain& p) {
                p.root = [](Group& r) {
                  Plain other;
                  other.group = "episode_1";
                  other.observation_shape = {4, 1};
                  other.observations = {1, 2, 3, 4};
                  other.write_into(r);
                };
              }),
              HasSubstr("episode_1/observations"));
  EXPECT_THAT(broken([](Plain& p) {
                p.root = [](Group& r) {
                  Plain other;
                  other.group = "episode_1";
                  other.action_shape = {3, 1};
                  other.write_into(r);
                };
              }),
              HasSubstr("episode_1/actions has 1 entries a step, those before 2"));
  EXPECT_THAT(broken([](Plain& p) {
                p.write_actions = false;
                p.episode = [](Group& e) {
                  const std::int64_t actions[] = {0, 70000, 1};
                  e.write("actions", {3}, Type::kInt64, actions);
                };
              }),
              HasSubstr("the discrete action 70000 is too large; the largest allowed is 65535"));
  EXPECT_THAT(broken([](Plain& p) {
                p.write_actions = false;
                p.episode = [](Group& e) { e.create_group("actions"); };
              }),
              HasSubstr("Dict or Tuple"));
}

TEST(Reader, RefusesOtherFiles) {
  const TemporaryFolder folder;
  const auto error = [](const std::string& path) -> std::string {
    try {
      read_demonstrations(path);
    } catch (const InputError& caught) {
      return caught.what();
    }
    return "(no error)";
  };
  EXPECT_THAT(error(folder / "absent.hdf5"), HasSubstr("does not exist"));
  EXPECT_THAT(error(folder / ""), HasSubstr("no Minari dataset"));
  // std::regex would exhaust the stack over these.
  for (const std::string ending : {"", "-v0"})
    EXPECT_THAT(error(std::string(50000, 'x') + ending), HasSubstr("File name too long"));
  std::filesystem::create_symlink("loop", folder / "loop");
  EXPECT_THAT(error(folder / "loop"), HasSubstr("levels of symbolic links"));
  std::filesystem::create_directories(folder / "closed/data");
  std::filesystem::create_symlink("main_data.hdf5", folder / "closed/data/main_data.hdf5");
  EXPECT_THAT(error(folder / "closed"), HasSubstr("levels of symbolic links"));
  write_file_atomically(folder / "text.hdf5", std::string_view("hello"));
  EXPECT_THAT(error(folder / "text.hdf5"), HasSubstr("not a complete HDF5 file"));
  write_file_atomically(folder / "empty.hdf5", std::string_view(""));
  EXPECT_THAT(error(folder / "empty.hdf5"), HasSubstr("not a complete HDF5 file"));

  write_demonstrations(sample({10}), folder / "d");
  write_file_atomically(folder / "d/data/metadata.json", std::string_view("{]"));
  EXPECT_THAT(error(folder / "d"), HasSubstr("not valid JSON"));
  write_file_atomically(folder / "d/data/metadata.json",
                        std::string_view(R"({"total_episodes": 2})"));
  EXPECT_THAT(error(folder / "d"), HasSubstr("2 episodes"));
  write_file_atomically(folder / "d/data/metadata.json",
                        std::string_view(std::string(100000, '[')));
  EXPECT_THAT(error(folder / "d"), HasSubstr("not valid JSON"));
  std::filesystem::remove(folder / "d/data/main_data.hdf5");
  EXPECT_THAT(error(folder / "d"), HasSubstr("another format"));
}

// Flipped bits and lost tails: an InputError, or the numbers; never anything else.
TEST(Reader, SurvivesRandomDamage) {
  Demonstrations demonstrations = sample({20, 30});
  remove_actions(demonstrations, {MaskPattern::kStep, 0.5, 0, std::nullopt});
  const std::vector<std::uint8_t> whole = encode_demonstrations(demonstrations);
  int noticed = 0;
  for (std::uint32_t round = 0; round < 400; ++round) {
    RandomStream random(7, Purpose::kDiagnostics, round);
    std::vector<std::uint8_t> bytes = whole;
    if (round % 4 == 0) {
      bytes.resize(random.below(static_cast<std::uint32_t>(bytes.size())));
    } else {
      for (std::uint32_t i = 0; i < 1 + round % 3; ++i)
        bytes[random.below(static_cast<std::uint32_t>(bytes.size()))] ^=
            static_cast<std::uint8_t>(1U << random.below(8));
    }
    try {
      read_demonstrations(bytes, "damaged");
    } catch (const InputError&) {
      ++noticed;
    }
  }
  EXPECT_GT(noticed, 300);
}

}  // namespace
}  // namespace agail
