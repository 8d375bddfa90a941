// Stepping allocates nothing: it is the inner loop of everything.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "env/support.h"

namespace {
std::atomic<long> allocations{0};
}

// Not inlined: GCC would warn of free() on what looks like another new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace agail {
namespace {

TEST(Allocation, SteppingAllocatesNothing) {
  for (const std::string& id : environment_ids()) {
    const auto env = make_environment(id);
    RandomStream random(1, Purpose::kReset);
    env->reset(random);
    const std::vector<float> action = random_action(env->spec().action, random);
    const long before = allocations;
    for (int i = 0; i < 50; ++i) env->step(action);
    EXPECT_EQ(allocations - before, 0) << id;
  }
}

}  // namespace
}  // namespace agail
