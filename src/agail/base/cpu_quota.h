// How many CPUs this process may use: the container's quota counts, not only the machine's cores.
#pragma once

#include <filesystem>
#include <string_view>

namespace agail {

// The smaller of the CPUs of sched_getaffinity and the cgroup quota, rounded down; at least 1.
int default_threads();

// CPUs of the tightest quota on the way from this process's control group to the root, or 0 for
// none. `mount`: where cgroups are mounted (/sys/fs/cgroup); `membership`: text of
// /proc/self/cgroup.
double cgroup_cpu_quota(const std::filesystem::path& mount, std::string_view membership);

}  // namespace agail
