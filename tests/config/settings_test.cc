#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>

#include "agail/config/resolve.h"
#include "agail/config/setting.h"
#include "agail/config/settings_file.h"
#include "agail/config/settings_reference.h"
#include "base/messages.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

Settings with(std::vector<std::string> assignments, std::string environment = "X-v0") {
  return resolve_settings({"default", std::move(environment), std::move(assignments)});
}

std::string refused(const std::string& assignment) {
  return input_error([&] { with({assignment}); });
}

TEST(SettingsTable, IsSound) {
  std::set<std::string> names;
  const Settings initial;
  for (const Setting& setting : settings_table()) {
    EXPECT_TRUE(names.insert(setting.name).second) << setting.name << " is there twice";
    EXPECT_FALSE(setting.help.empty()) << setting.name;
    EXPECT_NE(setting.help.back(), '.') << setting.name;
    EXPECT_TRUE(setting.allows(setting.get(initial))) << setting.name;
    EXPECT_EQ(std::holds_alternative<FieldOf<std::string>>(setting.field),
              !setting.allowed.choices.empty())
        << setting.name;
    EXPECT_EQ(find_setting(setting.name), &setting);
  }
}

// Two entries on one field would overwrite each other.
TEST(SettingsTable, EntriesHaveTheirOwnFields) {
  Settings settings;
  for (const Setting& setting : settings_table()) {
    std::string before = to_toml(settings);
    SettingValue value = setting.get(settings);
    if (auto* whole = std::get_if<std::int64_t>(&value)) *whole += 1;
    if (auto* number = std::get_if<double>(&value)) *number += 0.5;
    if (auto* flag = std::get_if<bool>(&value)) *flag = !*flag;
    if (auto* text = std::get_if<std::string>(&value)) *text += "x";
    if (auto* list = std::get_if<Sizes>(&value)) list->push_back(7);
    if (auto* maybe = std::get_if<std::optional<double>>(&value)) *maybe = 0.25;
    setting.set(settings, value);
    const std::string after = to_toml(settings);
    int changed = 0;
    for (std::size_t a = 0, b = 0; a < before.size();) {
      const std::size_t a_end = before.find('\n', a), b_end = after.find('\n', b);
      changed += before.substr(a, a_end - a) != after.substr(b, b_end - b);
      a = a_end + 1;
      b = b_end + 1;
    }
    EXPECT_EQ(changed, 1) << setting.name;
  }
}

TEST(Assignments, ReadEveryType) {
  const Settings s =
      with({"run.timesteps=5000", "trpo.max_kl = 0.02", "trpo.gamma=1", "policy.hidden=[64, 32]",
            "value.normalize_targets=true", "guide.target=own", "guide.reward=\"log-likelihood\"",
            "reward.beta=0.3"});
  EXPECT_EQ(s.run.timesteps, 5000);
  EXPECT_EQ(s.trpo.max_kl, 0.02);
  EXPECT_EQ(s.trpo.gamma, 1);
  EXPECT_EQ(s.policy.hidden, (Sizes{64, 32}));
  EXPECT_TRUE(s.value.normalize_targets);
  EXPECT_EQ(s.guide.target, "own");
  EXPECT_EQ(s.guide.reward, "log-likelihood");
  EXPECT_EQ(s.reward.beta, 0.3);
  EXPECT_EQ(with({"reward.beta=0.3", "reward.beta=auto"}).reward.beta, std::nullopt);
  EXPECT_EQ(with({"run.timesteps=1e6"}).run.timesteps, 1000000);
  EXPECT_EQ(with({"policy.hidden=[]"}).policy.hidden, Sizes{});
}

TEST(Assignments, RefuseInOneLine) {
  EXPECT_EQ(refused("trpo.max_kl=0"),
            "--set: trpo.max_kl = 0 is not allowed; give a number above 0 (nats)");
  EXPECT_EQ(refused("trpo.gamma=1.5"),
            "--set: trpo.gamma = 1.5 is not allowed; give a number above 0, at most 1");
  EXPECT_THAT(refused("trpo.max_kl=nan"), HasSubstr("is not allowed"));
  EXPECT_THAT(refused("trpo.max_kl=inf"), HasSubstr("is not allowed"));
  EXPECT_THAT(refused("trpo.max_kl=small"), HasSubstr("has the wrong type"));
  EXPECT_THAT(refused("run.lanes=1.5"), HasSubstr("give a whole number at least 1"));
  EXPECT_THAT(refused("run.lanes=1e300"), HasSubstr("has the wrong type"));
  EXPECT_THAT(refused("run.lanes=99999999999999999999"), HasSubstr("has the wrong type"));
  EXPECT_THAT(refused("run.lanes=true"), HasSubstr("has the wrong type"));
  EXPECT_THAT(refused("policy.hidden=[64, 0]"), HasSubstr("each at least 1"));
  EXPECT_THAT(refused("policy.hidden=[64, \"a\"]"), HasSubstr("a list of whole numbers"));
  EXPECT_THAT(refused("policy.hidden=64"), HasSubstr("a list of whole numbers"));
  EXPECT_THAT(refused("guide.target=mine"), HasSubstr("one of \"random\", \"nearest\", \"own\""));
  EXPECT_THAT(refused("reward.beta=much"), HasSubstr("\"auto\" or a number"));
  EXPECT_THAT(refused("trpo.max_kl"), HasSubstr("write --set key=value"));
  EXPECT_THAT(refused("trpo.max_kll=1"), HasSubstr("did you mean trpo.max_kl?"));
  EXPECT_THAT(refused("trpo=1"), HasSubstr("unknown setting"));
  EXPECT_THAT(refused("=1"), HasSubstr("unknown setting"));
  EXPECT_THAT(refused("trpo.max_kl="), HasSubstr("has the wrong type"));
  EXPECT_THAT(refused("trpo.max_kl=1\nrun.lanes=2"), HasSubstr("has the wrong type"));
}

TEST(Files, LaterLayersWin) {
  const TemporaryFolder folder;
  const std::string path = folder / "mine.toml";
  std::ofstream(path) << R"(preset = "paper"
trpo.max_kl = 0.5
[run]
batch_steps = 7
lanes = 7
checkpoint_every = 7
[environment."CartPole-v0".run]
batch_steps = 9
[environment.CartPole.run]
batch_steps = 8
lanes = 8
)";
  const Settings other = resolve_settings({path, "Hopper-v4", {}});
  EXPECT_EQ(other.trpo.max_kl, 0.5);
  EXPECT_EQ(other.run.batch_steps, 7);
  const Settings family = resolve_settings({path, "CartPole-v1", {}});
  EXPECT_EQ(family.run.batch_steps, 8);
  const Settings exact = resolve_settings({path, "CartPole-v0", {"run.checkpoint_every=10"}});
  EXPECT_EQ(exact.run.batch_steps, 9);
  EXPECT_EQ(exact.run.lanes, 8);
  EXPECT_EQ(exact.run.checkpoint_every, 10);
  // The base preset's tables come before the file.
  EXPECT_EQ(exact.run.timesteps, resolve_settings({"paper", "CartPole-v0", {}}).run.timesteps);
  EXPECT_EQ(environment_family("CartPole-v0"), "CartPole");
  EXPECT_EQ(environment_family("my-very-own"), "my-very-own");
  EXPECT_EQ(environment_family("A-v"), "A-v");
}

TEST(Files, RefuseWithFileAndLine) {
  const auto refused_file = [](const std::string& text) {
    return input_error([&] { parse_settings(text, "my.toml"); });
  };
  EXPECT_THAT(refused_file("\n[trpo]\nmax_kl = -1\n"), StartsWith("my.toml:3: trpo.max_kl = -1 "));
  EXPECT_EQ(refused_file("[trpo]\nmax_k = 1\n"),
            "my.toml:2: unknown setting 'trpo.max_k'; did you mean trpo.max_kl?");
  EXPECT_EQ(refused_file("[trop]\nmax_kl = 1\n"),
            "my.toml:1: unknown section 'trop'; did you mean trpo?");
  EXPECT_THAT(refused_file("[trpo.max_kl]\nx = 1\n"), HasSubstr("has the wrong type"));
  EXPECT_THAT(refused_file("trpo = 1\n"), HasSubstr("unknown setting 'trpo'"));
  EXPECT_THAT(refused_file("\ntrpo = = 1"), StartsWith("my.toml:2: not TOML: "));
  EXPECT_THAT(refused_file("preset = 3"), HasSubstr("preset is not a text"));
  EXPECT_THAT(refused_file("environment = 3"), HasSubstr("is not a table"));
  EXPECT_THAT(refused_file("environment.Hopper = 3"), HasSubstr("is not a table"));
  EXPECT_THAT(refused_file("\nenvironment.Hopper.trpo.max_kl = 0"), StartsWith("my.toml:2: "));
  EXPECT_THAT(refused_file("trpo.max_kl = [\n1,\n2\n]"), HasSubstr("trpo.max_kl = [ 1, 2 ]"));
  EXPECT_THAT(refused_file("trpo.max_kl = 1\ntrpo.max_kl = 2"), HasSubstr("not TOML"));
  EXPECT_THAT(refused_file(std::string("trpo.max_kl = \"\0\"", 17)), HasSubstr("not TOML"));
}

TEST(Files, UnknownPresets) {
  EXPECT_THAT(input_error([] {
                resolve_settings({"papr", "X-v0", {}});
              }),
              HasSubstr("did you mean paper?"));
  EXPECT_THAT(input_error([] {
                resolve_settings({"none.toml", "X-v0", {}});
              }),
              HasSubstr("cannot open none.toml"));
  const TemporaryFolder folder;
  const std::string path = folder / "mine.toml";
  std::ofstream(path) << "preset = \"papr\"";
  EXPECT_THAT(input_error([&] { resolve_settings({path, "X-v0", {}}); }), HasSubstr("mine.toml: "));
}

TEST(ConfigToml, RoundTripsExactly) {
  const TemporaryFolder folder;
  const std::string path = folder / "config.toml";
  for (const double value : {0.1, 1.0 / 3, 1e-300, 5e-324, 1.7976931348623157e308, 123456789.0,
                             1e22, std::nextafter(1.0, 2.0)}) {
    Settings settings = with({"policy.hidden=[1]", "discriminator.features=[0, 3]"});
    settings.trpo.max_kl = value;
    settings.reward.beta = value;
    settings.run.timesteps = std::numeric_limits<std::int64_t>::max();
    const std::string text = to_toml(settings);
    std::ofstream(path) << text;
    const Settings again = resolve_settings({path, "X-v0", {}});
    EXPECT_EQ(again.trpo.max_kl, value);
    EXPECT_EQ(to_toml(again), text);
  }
}

TEST(Presets, AreReadForEveryEnvironment) {
  ASSERT_GE(preset_files().size(), 2U);
  EXPECT_EQ(preset_files()[0].name, "default.toml");
  for (const char* preset : {"default", "paper"})
    for (const char* id : {"CartPole-v0", "Hopper-v4", "Humanoid-v4"})
      EXPECT_NO_THROW(resolve_settings({preset, id, {}}));
}

TEST(Reference, NamesEverySetting) {
  const std::string help = settings_help(), page = settings_markdown();
  for (const Setting& setting : settings_table()) {
    EXPECT_THAT(help, HasSubstr(setting.name + "\n"));
    EXPECT_THAT(page, HasSubstr("| `" + setting.name + "` |"));
    EXPECT_THAT(page, HasSubstr("\n## " + setting.name.substr(0, setting.name.find('.')) + "\n"));
  }
  EXPECT_THAT(page, HasSubstr("| setting | default | paper | unit | allowed | what it does |"));
  EXPECT_THAT(page, HasSubstr("| paper | `CartPole-v0` | `run.timesteps` | `50000` |"));
  EXPECT_THAT(page, HasSubstr("(\\|gradient\\| - 1)^2"));
}

}  // namespace
}  // namespace agail
