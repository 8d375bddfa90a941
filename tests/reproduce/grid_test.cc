#include "agail/reproduce/grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "base/temporary_folder.h"

namespace agail {
namespace {

namespace fs = std::filesystem;

// One run that needs demonstrations, and so the three candidates for their expert.
class GridTest : public testing::Test {
 protected:
  Grid grid() const {
    Experiment experiment;
    experiment.timesteps = 3000;
    const GridFilter filter{
        .environments = {"CartPole-v0"}, .methods = {"agail"}, .missing = {0.75}, .seeds = {0}};
    return prepare_grid(experiment, filter, {}, folder_.path(), experts_);
  }
  std::ptrdiff_t done() const { return std::ranges::count_if(grid().jobs, is_done); }

  static void make(const fs::path& file) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "{}";
  }
  fs::path record(const std::string& seed) const {
    return experts_ / "records" / ("CartPole-v0-" + seed + ".json");
  }
  fs::path policy(const std::string& seed) const {
    return experts_ / "runs" / ("CartPole-v0-" + seed) / "policy_best.safetensors";
  }

  const TemporaryFolder folder_;
  const fs::path experts_ = folder_ / "experts";
  const std::vector<std::string> seeds_ = {"10", "11", "12"};
};

TEST_F(GridTest, AnExpertIsDoneWithItsRecordAndItsPolicy) {
  EXPECT_EQ(grid().jobs.size(), 5U);
  for (const std::string& seed : seeds_) make(record(seed));
  EXPECT_EQ(done(), 0);
  for (const std::string& seed : seeds_) make(policy(seed));
  EXPECT_EQ(done(), 3);
}

// Or another process would take a policy that is half trained for the one of the record.
TEST_F(GridTest, TheRecordOfALostPolicyGoesBeforeItIsTrainedAgain) {
  const Grid whole = grid();
  make(record("10"));
  make(record("11"));
  make(policy("11"));
  for (const Job& job : whole.jobs)
    if (job.title.find("expert") != std::string::npos) {
      EXPECT_EQ(job.steps.front()(), 0);
    }
  EXPECT_FALSE(fs::exists(record("10")));
  EXPECT_TRUE(fs::exists(record("11")));
}

TEST_F(GridTest, RecordsOfEverythingNeedNoExperts) {
  make(folder_ / "records" / "CartPole-v0-agail-75-0.json");
  make(folder_ / "records" / "demonstrations" / "CartPole-v0.json");
  EXPECT_EQ(grid().jobs.size(), 1U);
  EXPECT_EQ(done(), 1);
}

}  // namespace
}  // namespace agail
