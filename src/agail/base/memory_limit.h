// How much memory this process may still take: the container's limit counts, not only the machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace agail {

constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};

// Bytes: the least of the machine's available memory (swap not counted), what is left below the
// memory limits of the control groups, and below the address space limit (ulimit -v). kUnlimited if
// none of them is known.
std::uint64_t available_memory();

// Throws InputError if that is less than `bytes`: "WHERE needs about 12.3 GB of memory, and ...".
void require_memory(std::uint64_t bytes, const std::string& where);

// Bytes left below the tightest memory limit on the way from this process's control group to the
// root, or kUnlimited. File cache that the kernel can drop counts as free. Arguments as of
// visit_cgroups().
std::uint64_t cgroup_memory_left(const std::filesystem::path& mount, std::string_view membership);

// MemAvailable in bytes, from the text of /proc/meminfo; kUnlimited if it has none.
std::uint64_t available_of_meminfo(std::string_view text);

}  // namespace agail
