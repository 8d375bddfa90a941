#include "agail/base/cpu_quota.h"

#include <sched.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

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

// Every group from `name` up to the root may have its own limit. In a container the outer part of
// the name may not be visible; then only the root is found, which is the container's own group.
template <class Read>
void tighten_upwards(double& quota, const fs::path& root, const std::string& name, Read read) {
  for (fs::path group = fs::path(name).relative_path();; group = group.parent_path()) {
    tighten(quota, read(root / group));
    if (group.empty()) return;
  }
}

bool has_controller(const std::string& list, const std::string& controller) {
  return ("," + list + ",").find("," + controller + ",") != std::string::npos;
}

}  // namespace

double cgroup_cpu_quota(const fs::path& mount, std::string_view membership) {
  double quota = 0;
  std::istringstream lines{std::string(membership)};
  for (std::string line; std::getline(lines, line);) {  // hierarchy:controllers:group
    const auto first = line.find(':');
    const auto second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    if (controllers.empty()) {
      tighten_upwards(quota, mount, group, read_v2);
      tighten_upwards(quota, mount / "unified", group, read_v2);
    } else if (has_controller(controllers, "cpu")) {
      tighten_upwards(quota, mount / "cpu", group, read_v1);
      tighten_upwards(quota, mount / "cpu,cpuacct", group, read_v1);
    }
  }
  return quota;
}

int default_threads() {
  cpu_set_t set;
  CPU_ZERO(&set);
  // Fails on machines with more than 1024 CPUs; then only the quota counts.
  int threads = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1024;
  std::ifstream file("/proc/self/cgroup");
  std::ostringstream membership;
  membership << file.rdbuf();
  const double quota = cgroup_cpu_quota("/sys/fs/cgroup", membership.str());
  if (quota > 0) threads = std::min(threads, static_cast<int>(std::min(quota, 1024.0)));
  return std::max(threads, 1);
}

}  // namespace agail
