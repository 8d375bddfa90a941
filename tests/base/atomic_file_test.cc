#include "agail/base/atomic_file.h"

#include <unistd.h>

#include <set>
#include <string>

#include "base/messages.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
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
  const TemporaryFolder folder;
  std::set<std::string> names;
  for (int i = 0; i < 2; ++i) {
    // A name that is too long tells the temporary one.
    try {
      write_file_atomically(folder / std::string(250, 'x'), "text");
    } catch (const SystemError& error) {
      names.insert(error.what());
    }
  }
  EXPECT_EQ(names.size(), 2U);
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
  create_output_folder(folder / "a/b");
  create_output_folder(folder / "a/b");
  create_output_folder("");
  EXPECT_TRUE(fs::is_directory(folder / "a/b"));
  write_file_atomically(folder / "file", "text");
  EXPECT_THAT(input_error([&] { create_output_folder(folder / "file"); }),
              HasSubstr("Not a directory"));
  EXPECT_THAT(input_error([&] { create_output_folder(folder / "file/below"); }),
              HasSubstr("Not a directory"));
  if (::geteuid() != 0) {  // root may write anywhere
    fs::permissions(folder / "a", fs::perms::owner_read | fs::perms::owner_exec);
    EXPECT_THAT(input_error([&] { create_output_folder(folder / "a"); }), HasSubstr("Permission"));
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
