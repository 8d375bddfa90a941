#include "agail/base/atomic_file.h"

#include <unistd.h>

#include <string>

#include "base/messages.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;
using Bytes = std::vector<std::uint8_t>;

TEST(AtomicFile, WritesReplacesAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const fs::path path = folder / "policy.safetensors";
  write_file_atomically(path, Bytes{1, 2, 0, 255});
  EXPECT_EQ(read_file(path), (Bytes{1, 2, 0, 255}));
  write_file_atomically(path, "");
  EXPECT_EQ(read_file(path), Bytes{});
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(AtomicFile, KeepsTheOldFileAndCleansUpWhenItFails) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_file_atomically(folder / "no/such/folder/x", "text"), SystemError);
  EXPECT_THAT(input_error([&] { write_file_atomically(folder.path(), "text"); }),
              HasSubstr("it is a folder"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
  try {
    write_file_atomically("/dev/full/x", "text");
    FAIL();
  } catch (const SystemError& error) {
    EXPECT_THAT(error.what(), HasSubstr("/dev/full"));
    EXPECT_THAT(error.what(), HasSubstr("Not a directory"));
  }
}

TEST(AtomicFile, CreatesOnlyWhatIsNotThere) {
  const TemporaryFolder folder;
  EXPECT_TRUE(create_file_atomically(folder / "x", "first"));
  EXPECT_FALSE(create_file_atomically(folder / "x", "second"));
  EXPECT_EQ(read_file(folder / "x"), (Bytes{'f', 'i', 'r', 's', 't'}));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

// Process ids are equal in two containers that share a file system.
TEST(AtomicFile, NoTemporaryNameTwice) {
  EXPECT_NE(temporary_name("x").string(), temporary_name("x").string());
}

TEST(AtomicFile, NamesMayBeAsLongAsTheyCanBe) {
  const TemporaryFolder folder;
  const std::string longest(250, 'x');
  write_file_atomically(folder / longest, "text");
  EXPECT_FALSE(create_file_atomically(folder / longest, "other"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
  const fs::path temporary = temporary_name(folder / longest);
  EXPECT_EQ(temporary.parent_path().string(), folder.path().string());
  EXPECT_THAT(temporary.filename().string(), StartsWith(".xxx"));
  EXPECT_THAT(temporary.filename().string(), EndsWith(".tmp"));
}

TEST(AtomicFile, LooksOnlyWhereOneCan) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "file", "text");
  EXPECT_TRUE(is_there(folder.path()));
  EXPECT_FALSE(is_there(folder / "none"));
  EXPECT_FALSE(is_there(folder / "file/below"));
  EXPECT_THAT(input_error([&] { is_there(folder / std::string(300, 'x')); }),
              HasSubstr("File name too long"));
}

TEST(AtomicFile, OutputFolder) {
  const TemporaryFolder folder;
  check_output_folder(folder / "a/b");
  check_output_folder("");
  EXPECT_TRUE(fs::is_empty(folder.path()));
  create_output_folder(folder / "a/b");
  create_output_folder(folder / "a/b");
  create_output_folder("");
  EXPECT_TRUE(fs::is_directory(folder / "a/b"));
  write_file_atomically(folder / "file", "text");
  EXPECT_THAT(input_error([&] { create_output_folder(folder / "file"); }),
              HasSubstr("Not a directory"));
  EXPECT_THAT(input_error([&] { create_output_folder(folder / "file/below"); }),
              HasSubstr("Not a directory"));
  for (const char* name : {"file", "file/below", "file/further/below"})
    EXPECT_THAT(input_error([&] { check_output_folder(folder / name); }),
                HasSubstr("Not a directory"));
  if (::geteuid() != 0) {  // root may write anywhere
    fs::permissions(folder / "a", fs::perms::owner_read | fs::perms::owner_exec);
    EXPECT_THAT(input_error([&] { create_output_folder(folder / "a"); }), HasSubstr("Permission"));
    EXPECT_THAT(input_error([&] { check_output_folder(folder / "a"); }), HasSubstr("Permission"));
    fs::permissions(folder / "a", fs::perms::owner_all);
  }
}

TEST(AtomicFile, ReadingRefuses) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "ten", "0123456789");
  EXPECT_EQ(read_file(folder / "ten", 10).size(), 10U);
  EXPECT_THAT(input_error([&] { read_file(folder / "ten", 9); }), HasSubstr("larger than 9 bytes"));
  EXPECT_THAT(input_error([&] { read_file(folder / "none"); }), HasSubstr("No such file"));
  EXPECT_THAT(input_error([&] { read_file(folder.path()); }), HasSubstr("it is a folder"));
  EXPECT_THAT(input_error([&] { read_file("/dev/zero", 5000); }), HasSubstr("larger than"));
}

}  // namespace
}  // namespace agail
