#include "agail/base/memory_limit.h"

#include <gmock/gmock.h>

#include <fstream>

#include "agail/base/error.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(MemoryLimit, Version2TakesTheTightestGroupUpwards) {
  const TemporaryFolder mount;
  write(mount / "a/b/memory.max", "max\n");
  write(mount / "a/b/memory.current", "70\n");
  EXPECT_EQ(cgroup_memory_left(mount.path(), "0::/a/b\n"), kUnlimited);
  write(mount / "a/memory.max", "1000\n");
  write(mount / "a/memory.current", "300\n");
  EXPECT_EQ(cgroup_memory_left(mount.path(), "0::/a/b\n"), 700);
  EXPECT_EQ(cgroup_memory_left(mount.path(), "0::/other\n"), kUnlimited);
  // What the kernel can drop is free.
  write(mount / "a/memory.stat", "anon 200\ninactive_file 100\nactive_file 50\n");
  EXPECT_EQ(cgroup_memory_left(mount.path(), "0::/a/b\n"), 800);
  write(mount / "memory.max", "400\n");
  write(mount / "memory.current", "500\n");
  EXPECT_EQ(cgroup_memory_left(mount.path(), "0::/a/b\n"), 0);
}

TEST(MemoryLimit, Version1) {
  const TemporaryFolder mount;
  const std::string membership = "4:memory:/x\n3:cpu,cpuacct:/docker/12\n0::/\n";
  EXPECT_EQ(cgroup_memory_left(mount.path(), membership), kUnlimited);
  write(mount / "memory/memory.limit_in_bytes", "9000\n");
  write(mount / "memory/memory.usage_in_bytes", "5000\n");
  write(mount / "memory/memory.stat", "inactive_file 1\ntotal_inactive_file 1500\n");
  EXPECT_EQ(cgroup_memory_left(mount.path(), membership), 5500);
  write(mount / "memory/x/memory.limit_in_bytes", "600\n");
  write(mount / "memory/x/memory.usage_in_bytes", "200\n");
  EXPECT_EQ(cgroup_memory_left(mount.path(), membership), 400);
}

TEST(MemoryLimit, OfTheMachine) {
  EXPECT_EQ(available_of_meminfo("MemTotal:  9 kB\nMemFree: 1 kB\nMemAvailable:    4 kB\n"), 4096);
  EXPECT_EQ(available_of_meminfo(""), kUnlimited);
  EXPECT_LT(available_memory(), kUnlimited);
}

TEST(MemoryLimit, RefusesWhatDoesNotFit) {
  EXPECT_NO_THROW(require_memory(1 << 20, "demos.hdf5"));
  try {
    require_memory(std::uint64_t{1} << 60, "demos.hdf5");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("demos.hdf5 needs about 1.15e+09 GB of memory"));
  }
}

}  // namespace
}  // namespace agail
