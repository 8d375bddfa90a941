#include "agail/base/cpu_quota.h"

#include <sched.h>

#include <algorithm>
#include <fstream>

#include "agail/base/cgroup.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

void tighten(double& quota, double candidate) {
  if (candidate > 0 && (quota == 0 || candidate < quota)) quota = candidate;
}

// cgroup v2: "max 100000" or "150000 100000" (microseconds of a period).
double read_v2(const fs::path& group) {
  std::ifstream file(group / "cpu.max");
  double quota = 0, period = 0;
  return file >> quota >> period && period > 0 ? quota / period : 0;
}

// cgroup v1: -1 is no limit.
double read_v1(const fs::path& group) {
  std::ifstream quota_file(group / "cpu.cfs_quota_us"), period_file(group / "cpu.cfs_period_us");
  double quota = 0, period = 0;
  const bool read = quota_file >> quota && period_file >> period && quota > 0 && period > 0;
  return read ? quota / period : 0;
}

}  // namespace

double cgroup_cpu_quota(const fs::path& mount, std::string_view membership) {
  double quota = 0;
  visit_cgroups(mount, membership, "cpu", [&](const fs::path& group, CgroupVersion version) {
    tighten(quota, version == CgroupVersion::kV2 ? read_v2(group) : read_v1(group));
  });
  return quota;
}

int default_threads() {
  cpu_set_t set;
  CPU_ZERO(&set);
  // Fails on machines with more than 1024 CPUs; then only the quota counts.
  int threads = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1024;
  const double quota = cgroup_cpu_quota("/sys/fs/cgroup", cgroup_membership());
  if (quota > 0) threads = std::min(threads, static_cast<int>(std::min(quota, 1024.0)));
  return std::max(threads, 1);
}

}  // namespace agail
