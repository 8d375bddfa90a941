// The training loop allocates nothing once it is warm.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

#include "agail/train/trainer.h"
#include "imitation/support.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
#define AGAIL_COUNTS_ALLOCATIONS 0
#else
#define AGAIL_COUNTS_ALLOCATIONS 1
#endif

namespace {
std::atomic<bool> counting{false};
std::atomic<long> allocations{0};
[[maybe_unused]] void count() {  // the sanitizers bring their own malloc
  if (counting.load(std::memory_order_relaxed)) ++allocations;
}
}  // namespace

#if AGAIL_COUNTS_ALLOCATIONS
// In front of glibc's, which operator new, Eigen and all libraries then call.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-inconsistent-declaration-parameter-name)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count();
  return __libc_calloc(n, size);
}
void* realloc(void* memory, std::size_t size) {
  count();
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  count();
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
}
// NOLINTEND(bugprone-reserved-identifier,readability-inconsistent-declaration-parameter-name)
#endif

namespace agail {
namespace {

struct Case {
  std::string environment, target;
  int threads;
};

class AllocationTest : public testing::TestWithParam<Case> {};

TEST_P(AllocationTest, UpdatesAllocateNothing) {
  if (!AGAIL_COUNTS_ALLOCATIONS) GTEST_SKIP() << "the sanitizers bring their own malloc";
  TrainingTask task;
  task.environment = GetParam().environment;
  task.method = "agail";
  task.seed = 1;
  task.threads = GetParam().threads;
  task.settings.run.batch_steps = 256;
  task.settings.run.lanes = 2;
  task.settings.policy.hidden = {64, 64};
  task.settings.discriminator.every = 2;
  task.settings.discriminator.gradient_penalty = 0.1;
  task.settings.guide.target = GetParam().target;
  task.settings.value.normalize_targets = true;
  task.settings.trpo.entropy_weight = 1e-3;
  task.settings.reward.centring = 1;
  task.settings.start.method = "clone-inferred";
  task.settings.bc.epochs = 1;
  task.settings.inverse_dynamics.epochs = 1;
  task.settings.clone.weight = 0.1;
  task.settings.clone.minibatch = 100;
  task.demonstrations = random_demonstrations(task.environment, 20, 3);
  remove_actions(*task.demonstrations,
                 {.pattern = MaskPattern::kStep, .ratio = 0.5, .seed = 1, .dimension = {}});
  Trainer trainer(std::move(task));
  for (int warm_up = 0; warm_up < 2; ++warm_up) trainer.update();
  counting = true;
  for (int update = 0; update < 4; ++update) {
    const long before = allocations;
    trainer.update();
    EXPECT_EQ(allocations - before, 0) << "update " << update;
  }
  counting = false;
  // That the counter counts at all.
  counting = true;
  const long before = allocations;
  std::vector<double> seen(1000);
  counting = false;
  EXPECT_EQ(allocations - before, 1);
  EXPECT_EQ(seen.size(), 1000U);
}

INSTANTIATE_TEST_SUITE_P(Methods, AllocationTest,
                         testing::Values(Case{"CartPole-v1", "random", 1},
                                         Case{"CartPole-v1", "own", 1},
                                         Case{"Hopper-v5", "random", 2},
                                         Case{"Hopper-v5", "nearest", 1}),
                         [](const auto& test) {
                           const Case& c = test.param;
                           return c.environment.substr(0, c.environment.find('-')) + "_" +
                                  c.target + "_" + std::to_string(c.threads) +
                                  (c.threads == 1 ? "_thread" : "_threads");
                         });

}  // namespace
}  // namespace agail
