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

// Before there is memory for them.
TEST(SavedPolicy, RefusesAStructureOfMoreWeightsThanTheFileHas) {
  TensorStore store = shaped_policy({}).store();
  std::string& structure = store.metadata.at("structure");
  const std::string hidden = "\"hidden\":[4]";
  structure.replace(structure.find(hidden), hidden.size(), "\"hidden\":[1048576,1048576]");
  const std::vector<std::uint8_t> bytes = to_safetensors(store);
  EXPECT_THAT(input_error([&] { SavedPolicy::decode(bytes, "p"); }), HasSubstr("more weights"));
}

}  // namespace
}  // namespace agail
