#include "agail/train/safetensors.h"

#include "base/messages.h"

namespace agail {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using Bytes = std::vector<std::uint8_t>;

TensorStore example() {
  TensorStore store;
  store.tensors["weights"] = {DType::kF32, {2, 3}, Bytes(24, 1)};
  store.tensors["count"] = {DType::kI64, {}, Bytes(8, 2)};
  store.tensors["flags"] = {DType::kU8, {3}, Bytes(3, 3)};
  store.tensors["empty"] = {DType::kF64, {0, 5}, {}};
  store.metadata = {{"kind", "policy"}, {"text", "ö \"quoted\"\n"}};
  return store;
}

Bytes file(const std::string& header, std::size_t data) {
  Bytes bytes;
  for (unsigned i = 0; i < 8; ++i)
    bytes.push_back(static_cast<std::uint8_t>(header.size() >> (8 * i)));
  bytes.insert(bytes.end(), header.begin(), header.end());
  bytes.resize(bytes.size() + data);
  return bytes;
}

std::string refused(const Bytes& bytes, Checksum checksum = Checksum::kIfPresent) {
  return input_error([&] { from_safetensors(bytes, "p.safetensors", checksum); });
}

bool same(const TensorStore& a, const TensorStore& b) {
  return to_safetensors(a) == to_safetensors(b);
}

TEST(Safetensors, RoundTrip) {
  const Bytes bytes = to_safetensors(example());
  const TensorStore store = from_safetensors(bytes, "p", Checksum::kRequired);
  EXPECT_EQ(store.metadata, example().metadata);
  EXPECT_EQ(store.tensors.size(), 4U);
  EXPECT_EQ(store.tensors.at("weights").shape, (std::vector<std::size_t>{2, 3}));
  EXPECT_EQ(store.tensors.at("flags").bytes, Bytes(3, 3));
  EXPECT_EQ(store.tensors.at("empty").shape, (std::vector<std::size_t>{0, 5}));
  EXPECT_EQ(to_safetensors(store), bytes);
  EXPECT_EQ(bytes[0] % 8, 0);
  EXPECT_TRUE(same(from_safetensors(to_safetensors({}), "p", Checksum::kRequired), {}));
}

// Whatever single byte changes: an error, or (blanks in the header) the same content.
TEST(Safetensors, EveryDamagedByteIsNoticed) {
  const Bytes good = to_safetensors(example());
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int change : {1, 2, 32, 128, 255}) {
      Bytes bad = good;
      bad[i] = static_cast<std::uint8_t>(bad[i] ^ change);
      try {
        EXPECT_TRUE(same(from_safetensors(bad, "p", Checksum::kRequired), example())) << i;
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), StartsWith("p: "));
        EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
      }
    }
  }
}

TEST(Safetensors, EveryTruncationAndExtensionIsNoticed) {
  const Bytes good = to_safetensors(example());
  for (std::size_t size = 0; size < good.size(); ++size)
    refused(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)),
            Checksum::kRequired);
  Bytes longer = good;
  longer.push_back(0);
  EXPECT_THAT(refused(longer), HasSubstr("bytes behind the last array"));
}

TEST(Safetensors, Checksum) {
  const Bytes plain = file(R"({"a":{"dtype":"U8","shape":[1],"data_offsets":[0,1]}})", 1);
  EXPECT_EQ(from_safetensors(plain, "p", Checksum::kIfPresent).tensors.size(), 1U);
  EXPECT_THAT(refused(plain, Checksum::kRequired), HasSubstr("has no checksum"));
  Bytes bad = to_safetensors(example());
  bad.back() ^= 1;
  EXPECT_EQ(
      refused(bad),
      "p.safetensors: the checksum does not match; the file is damaged: copy or train it again");
  EXPECT_THAT(refused(file(R"({"__metadata__":{"checksum":"md5:1"}})", 0)), HasSubstr("checksum"));
}

TEST(Safetensors, RefusesWhatTheFormatForbids) {
  const auto header = [](const std::string& text, std::size_t data = 8) {
    return refused(file(text, data));
  };
  const auto entry = [&](const std::string& fields) { return header("{\"a\":{" + fields + "}}"); };
  EXPECT_THAT(refused({}), HasSubstr("shorter than 8 bytes"));
  EXPECT_THAT(refused(Bytes(8, 255)), HasSubstr("cut short"));
  EXPECT_THAT(header(""), HasSubstr("not JSON"));
  EXPECT_THAT(header(R"({"a":1e999})"), HasSubstr("not JSON"));
  EXPECT_THAT(header("[]"), HasSubstr("not a JSON object"));
  EXPECT_THAT(header("{\"a\xff\":1}"), HasSubstr("not JSON"));
  EXPECT_THAT(header(std::string(100000, '[')), HasSubstr("nested too deeply"));
  EXPECT_THAT(header(R"({"a":1})"), HasSubstr("exactly dtype, shape and data_offsets"));
  EXPECT_THAT(header(R"({"__metadata__":{"a":1}})"), HasSubstr("not a text"));
  EXPECT_THAT(header(R"({"__metadata__":[]})"), HasSubstr("not a JSON object"));
  const std::string twice = R"("a":{"dtype":"U8","shape":[4],"data_offsets":[0,4]})";
  EXPECT_THAT(header("{" + twice + "," + twice + "}"), HasSubstr("'a' twice"));
  EXPECT_THAT(entry(R"("dtype":"U8","dtype":"U8","shape":[8],"data_offsets":[0,8])"),
              HasSubstr("'dtype' twice"));
  EXPECT_THAT(entry(R"("dtype":"BF16","shape":[4],"data_offsets":[0,8])"),
              HasSubstr("convert it to F32"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":[7],"data_offsets":[0,8])"), HasSubstr("another size"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":[-8],"data_offsets":[0,8])"), HasSubstr("no size"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":[8.0],"data_offsets":[0,8])"), HasSubstr("no size"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":8,"data_offsets":[0,8])"), HasSubstr("not a list"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":[8],"data_offsets":[0,9])"), HasSubstr("outside"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":[8],"data_offsets":[8,0])"), HasSubstr("outside"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":[8],"data_offsets":[0])"), HasSubstr("outside"));
  EXPECT_THAT(entry(R"("dtype":"F32","shape":[4611686018427387905,4],"data_offsets":[0,8])"),
              HasSubstr("overflows"));
  EXPECT_THAT(entry(R"("dtype":"U8","shape":[7],"data_offsets":[1,8])"),
              HasSubstr("gap or overlap"));
  EXPECT_THAT(
      header(
          R"({"a":{"dtype":"U8","shape":[5],"data_offsets":[0,5]},"b":{"dtype":"U8","shape":[4],"data_offsets":[4,8]}})"),
      HasSubstr("gap or overlap"));
}

}  // namespace
}  // namespace agail
