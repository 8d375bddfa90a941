#include "agail/base/cpu_quota.h"

#include <gtest/gtest.h>

#include <fstream>

#include "base/temporary_folder.h"

namespace agail {
namespace {

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(CpuQuota, Version2TakesTheTightestGroupUpwards) {
  const TemporaryFolder mount;
  write(mount / "a/b/cpu.max", "max 100000\n");
  write(mount / "a/cpu.max", "150000 100000\n");
  EXPECT_EQ(cgroup_cpu_quota(mount.path(), "0::/a/b\n"), 1.5);
  EXPECT_EQ(cgroup_cpu_quota(mount.path(), "0::/other\n"), 0);
  write(mount / "cpu.max", "50000 100000\n");
  EXPECT_EQ(cgroup_cpu_quota(mount.path(), "0::/a/b\n"), 0.5);
}

TEST(CpuQuota, Version1) {
  const TemporaryFolder mount;
  write(mount / "cpu/cpu.cfs_quota_us", "-1\n");
  write(mount / "cpu/cpu.cfs_period_us", "100000\n");
  const std::string membership = "4:memory:/x\n3:cpu,cpuacct:/docker/12\n0::/\n";
  EXPECT_EQ(cgroup_cpu_quota(mount.path(), membership), 0);
  // Inside a container only the root of the mount is visible, and it is the container's group.
  write(mount / "cpu/cpu.cfs_quota_us", "400000\n");
  EXPECT_EQ(cgroup_cpu_quota(mount.path(), membership), 4);
  write(mount / "cpu,cpuacct/docker/12/cpu.cfs_quota_us", "200000\n");
  write(mount / "cpu,cpuacct/docker/12/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(cgroup_cpu_quota(mount.path(), membership), 2);
}

TEST(CpuQuota, AtLeastOneThread) { EXPECT_GE(default_threads(), 1); }

}  // namespace
}  // namespace agail
