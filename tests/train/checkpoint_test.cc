#include "agail/train/checkpoint.h"

#include <gtest/gtest.h>

#include "agail/base/atomic_file.h"
#include "agail/train/task_request.h"
#include "base/temporary_folder.h"

namespace agail {
namespace {

TrainingTask small_task() {
  return make_training_task({.environment = "CartPole-v1",
                             .method = "trpo",
                             .assignments = {"policy.hidden=[4]", "value.hidden=[4]"},
                             .threads = 1});
}

class Checkpoint : public testing::Test {
 protected:
  Checkpoint() { create_output_folder(file_.parent_path()); }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = CheckpointFile::path(folder_.path());
  Trainer trainer_{small_task()};
  const CheckpointFile checkpoint_{folder_.path(), trainer_};
};

TEST_F(Checkpoint, KeepsTheEvaluations) {
  RunEvaluations saved{Evaluation{{2, 4}, {20, 40}, 1}, Evaluation{{1}, {10}, 0}}, loaded;
  checkpoint_.save(trainer_, saved);
  ASSERT_TRUE(checkpoint_.load(trainer_, loaded));
  ASSERT_TRUE(loaded.best && loaded.last);
  EXPECT_EQ(loaded.best->returns, (std::vector<double>{2, 4}));
  EXPECT_EQ(loaded.best->lengths, (std::vector<double>{20, 40}));
  EXPECT_EQ(loaded.best->diverged, 1);
  EXPECT_EQ(loaded.last->returns, (std::vector<double>{1}));

  RunEvaluations none;
  checkpoint_.save(trainer_, none);
  ASSERT_TRUE(checkpoint_.load(trainer_, loaded));
  EXPECT_FALSE(loaded.best || loaded.last);
}

}  // namespace
}  // namespace agail
