#include "agail/base/memory_limit.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "agail/base/cgroup.h"
#include "agail/base/error.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

// The number in a file of one; kUnlimited if there is none ("max").
std::uint64_t number_in(const fs::path& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

// The number after `key` in a text of "key number" lines; 0 if there is none.
std::uint64_t value_of(std::istream& lines, std::string_view key) {
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    std::uint64_t number = 0;
    if (words >> name >> number && name == key) return number;
  }
  return 0;
}

std::uint64_t difference(std::uint64_t a, std::uint64_t b) { return a > b ? a - b : 0; }

std::uint64_t left_in(const fs::path& group, CgroupVersion version) {
  const bool v2 = version == CgroupVersion::kV2;
  const std::uint64_t limit = number_in(group / (v2 ? "memory.max" : "memory.limit_in_bytes"));
  const std::uint64_t used = number_in(group / (v2 ? "memory.current" : "memory.usage_in_bytes"));
  if (limit == kUnlimited || used == kUnlimited) return kUnlimited;
  std::ifstream stat(group / "memory.stat");
  const std::uint64_t cache = value_of(stat, v2 ? "inactive_file" : "total_inactive_file");
  return difference(limit, difference(used, cache));
}

std::uint64_t address_space_left() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  const std::uint64_t pages = number_in("/proc/self/statm");  // its first number: all of it
  if (pages == kUnlimited) return limit.rlim_cur;
  return difference(limit.rlim_cur, pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)));
}

std::string gigabytes(std::uint64_t bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g GB", 1e-9 * static_cast<double>(bytes));
  return text;
}

}  // namespace

std::uint64_t cgroup_memory_left(const fs::path& mount, std::string_view membership) {
  std::uint64_t left = kUnlimited;
  visit_cgroups(mount, membership, "memory", [&](const fs::path& group, CgroupVersion version) {
    left = std::min(left, left_in(group, version));
  });
  return left;
}

std::uint64_t available_of_meminfo(std::string_view text) {
  std::istringstream lines{std::string(text)};
  const std::uint64_t kibibytes = value_of(lines, "MemAvailable:");
  return kibibytes > 0 ? kibibytes * 1024 : kUnlimited;
}

std::uint64_t available_memory() {
  std::ifstream file("/proc/meminfo");
  std::ostringstream meminfo;
  meminfo << file.rdbuf();
  return std::min({available_of_meminfo(meminfo.str()),
                   cgroup_memory_left("/sys/fs/cgroup", cgroup_membership()),
                   address_space_left()});
}

void require_memory(std::uint64_t bytes, const std::string& where) {
  const std::uint64_t available = available_memory();
  if (bytes <= available) return;
  throw InputError(where + " needs about " + gigabytes(bytes) + " of memory, and " +
                   gigabytes(available) +
                   " are available here; use fewer episodes, or a machine or container with more");
}

}  // namespace agail
