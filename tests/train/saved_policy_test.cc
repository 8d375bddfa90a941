#include "agail/train/saved_policy.h"

#include "agail/train/safetensors.h"
#include "base/messages.h"
#include "train/plain_policy.h"

namespace agail {
namespace {

using testing::HasSubstr;
using testing::Not;
using Numbers = std::vector<std::int64_t>;
using Layout = std::map<std::string, Numbers>;

SavedPolicy shaped_policy(const Layout& layout) {
  const ActionSpace action{
      .discrete = false, .dim = 4, .n = 0, .low = {-1, -1, -1, -1}, .high = {1, 1, 1, 1}};
  PolicyInfo info{"Shaped-v0", "trpo", 0, "", {}};
  info.layout = layout;
  return plain_policy(std::move(info), 6, action);
}

SavedPolicy again(const SavedPolicy& policy) { return SavedPolicy::decode(policy.encode(), "p"); }

TEST(SavedPolicy, KeepsTheLayoutOfTheEnvironmentsSpaces) {
  const Layout shapes = {{"observation_shape", Numbers{2, 3}}, {"action_shape", Numbers{2, 2}}};
  const Layout starts = {{"observation_start", Numbers{-5}}, {"action_start", Numbers{7}}};
  for (const Layout& layout : {shapes, starts}) {
    const SavedPolicy policy = shaped_policy(layout);
    EXPECT_EQ(again(policy).info().layout, layout);
    EXPECT_EQ(again(policy).encode(), policy.encode());
  }
}

TEST(SavedPolicy, SaysNothingOfALayoutThatIsItsOwn) {
  EXPECT_THAT(shaped_policy({}).store().metadata.at("structure"), Not(HasSubstr("layout")));
  EXPECT_TRUE(again(shaped_policy({})).info().layout.empty());
}

TEST(SavedPolicy, RefusesALayoutThatDoesNotFit) {
  const auto refused = [](const std::string& name, const Numbers& numbers) {
    Layout layout;
    layout[name] = numbers;
    return input_error([&] { again(shaped_policy(layout)); });
  };
  const auto nonsense = HasSubstr("makes no sense");
  for (const Numbers& shape : {Numbers{2, 2}, Numbers{-2, -3}, Numbers{}})
    EXPECT_THAT(refused("observation_shape", shape), nonsense);
  for (const Numbers& shape : {Numbers{5}, Numbers{1 << 30, 1 << 30, 1 << 30}})
    EXPECT_THAT(refused("action_shape", shape), nonsense);
  for (const Numbers& start : {Numbers{}, Numbers{1, 2}}) {
    EXPECT_THAT(refused("observation_start", start), nonsense);
    EXPECT_THAT(refused("action_start", start), nonsense);
  }
}

// The bytes of a policy whose structure says `instead` where it said `of`.
std::vector<std::uint8_t> with_structure(const std::string& of, const std::string& instead) {
  TensorStore store = shaped_policy({{"action_start", Numbers{7}}}).store();
  std::string& structure = store.metadata.at("structure");
  structure.replace(structure.find(of), of.size(), instead);
  return to_safetensors(store);
}

TEST(SavedPolicy, RefusesNumbersThatAreNoCounts) {
  for (const char* name : {R"("hidden":[4])", R"("action_dim":4)", R"("observation_dim":6)",
                           R"("layout":{"action_start":[7]})"}) {
    const std::string of = name;
    const std::size_t number = of.find_first_of("0123456789");
    for (const char* instead : {"-1.7e308", "4.5", "1e300", "4294967300", "true", R"("4")"}) {
      const std::string wrong = of.substr(0, number) + instead + of.substr(number + 1);
      if (of.find("start") != std::string::npos && wrong.find("4294967300") != std::string::npos)
        continue;  // spaces may start there
      EXPECT_THAT(input_error([&] { SavedPolicy::decode(with_structure(of, wrong), "p"); }),
                  HasSubstr("makes no sense"))
          << wrong;
    }
  }
}

// Before there is memory for them.
TEST(SavedPolicy, RefusesAStructureOfMoreWeightsThanTheFileHas) {
  const auto bytes = with_structure(R"("hidden":[4])", R"("hidden":[1048576,1048576])");
  EXPECT_THAT(input_error([&] { SavedPolicy::decode(bytes, "p"); }), HasSubstr("more weights"));
}

}  // namespace
}  // namespace agail
