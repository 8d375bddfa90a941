// The control groups that limit this process: a container's own, and those around it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace agail {

enum class CgroupVersion { kV1 = 1, kV2 = 2 };
using CgroupVisit = std::function<void(const std::filesystem::path& folder, CgroupVersion version)>;

// Calls `visit` for the groups of `controller` ("cpu", "memory"), from this process's own up to the
// root; each may have a limit of its own, and folders need not exist. In a container the outer part
// of the name may not be visible; then only the root is found, which is the container's own group.
// `mount`: where cgroups are mounted (/sys/fs/cgroup); `membership`: text of /proc/self/cgroup.
void visit_cgroups(const std::filesystem::path& mount, std::string_view membership,
                   std::string_view controller, const CgroupVisit& visit);

// The text of /proc/self/cgroup; empty if there is none.
std::string cgroup_membership();

}  // namespace agail
