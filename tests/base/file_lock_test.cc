#include "agail/base/file_lock.h"

#include <sys/wait.h>
#include <unistd.h>

#include <optional>

#include "base/messages.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

TEST(FileLock, OneHolderAtATime) {
  const TemporaryFolder folder;
  std::optional<FileLock> first(folder / "lock");
  EXPECT_TRUE(first->held());
  EXPECT_FALSE(FileLock(folder / "lock").held());
  first.reset();
  EXPECT_TRUE(FileLock(folder / "lock").held());
}

TEST(FolderLock, OneHolderAtATime) {
  const TemporaryFolder folder;
  std::optional<FolderLock> first(folder.path());
  EXPECT_TRUE(first->held());
  EXPECT_FALSE(FolderLock(folder.path()).held());
  first.reset();
  EXPECT_TRUE(FolderLock(folder.path()).held());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_THAT(input_error([&] { FolderLock(folder / "none"); }), testing::HasSubstr("none"));
}

// As the worker processes of an environment may.
TEST(FolderLock, EndsAlthoughAForkedChildLivesOn) {
  const TemporaryFolder folder;
  std::optional<FolderLock> lock(folder.path());
  int wait[2];
  ASSERT_EQ(::pipe(wait), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(wait[1]);
    char end = 0;
    ::_exit(::read(wait[0], &end, 1) == 0 ? 0 : 1);
  }
  ::close(wait[0]);
  lock.reset();
  EXPECT_TRUE(FolderLock(folder.path()).held());
  ::close(wait[1]);
  EXPECT_EQ(::waitpid(child, nullptr, 0), child);
}

}  // namespace
}  // namespace agail
