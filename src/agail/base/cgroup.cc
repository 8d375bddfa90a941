#include "agail/base/cgroup.h"

#include <fstream>
#include <sstream>

namespace agail {
namespace {

namespace fs = std::filesystem;

void visit_upwards(const fs::path& root, const std::string& name, CgroupVersion version,
                   const CgroupVisit& visit) {
  for (fs::path group = fs::path(name).relative_path();; group = group.parent_path()) {
    visit(root / group, version);
    if (group.empty()) return;
  }
}

bool has_controller(const std::string& list, std::string_view controller) {
  return ("," + list + ",").find("," + std::string(controller) + ",") != std::string::npos;
}

}  // namespace

void visit_cgroups(const fs::path& mount, std::string_view membership, std::string_view controller,
                   const CgroupVisit& visit) {
  std::istringstream lines{std::string(membership)};
  for (std::string line; std::getline(lines, line);) {  // hierarchy:controllers:group
    const auto first = line.find(':');
    const auto second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    if (controllers.empty()) {
      visit_upwards(mount, group, CgroupVersion::kV2, visit);
      visit_upwards(mount / "unified", group, CgroupVersion::kV2, visit);
    } else if (has_controller(controllers, controller)) {
      // Mounted under its own name, or with those that it shares a hierarchy with.
      visit_upwards(mount / controller, group, CgroupVersion::kV1, visit);
      if (controllers != controller)
        visit_upwards(mount / controllers, group, CgroupVersion::kV1, visit);
    }
  }
}

std::string cgroup_membership() {
  std::ifstream file("/proc/self/cgroup");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace agail
