#include "base/worker.h"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <vector>

namespace polymorph {
namespace {

class WorkerTest : public ::testing::Test {
 protected:
  void TearDown() override { set_thread_count(0); }
};

TEST_F(WorkerTest, RunsTasksInTheirOrderOnOneThreadThatStays) {
  set_thread_count(2);
  Worker worker;
  std::vector<int> order;
  std::vector<std::future<std::thread::id>> threads;
  for (int i = 0; i < 100; ++i)
    threads.push_back(worker.run([&order, i] {
      order.push_back(i);
      return std::this_thread::get_id();
    }));
  const std::thread::id thread = threads.front().get();
  EXPECT_NE(thread, std::this_thread::get_id());
  for (std::size_t i = 1; i < threads.size(); ++i) EXPECT_EQ(threads[i].get(), thread);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
}

TEST_F(WorkerTest, LoopsOfATaskUseTheGivenNumberOfThreads) {
  set_thread_count(8);
  for (const int count : {1, 3}) {
    Worker worker(count);
    EXPECT_EQ(worker.run([] { return tbb::this_task_arena::max_concurrency(); }).get(), count);
  }
}

TEST_F(WorkerTest, WithOneThreadATaskRunsWhereItsResultIsAskedFor) {
  set_thread_count(1);
  Worker worker;
  bool ran = false;
  auto result = worker.run([&ran] {
    ran = true;
    return std::this_thread::get_id();
  });
  EXPECT_FALSE(ran);
  EXPECT_EQ(result.get(), std::this_thread::get_id());
}

TEST_F(WorkerTest, TakesWhatOnlyMovesAndHandsErrorsOn) {
  set_thread_count(2);
  Worker worker;
  auto moved = worker.run([number = std::make_unique<int>(7)] { return *number; });
  EXPECT_EQ(moved.get(), 7);
  auto failed = worker.run([]() -> int { throw std::runtime_error("no"); });
  EXPECT_THROW(failed.get(), std::runtime_error);
  EXPECT_EQ(worker.run([] { return 8; }).get(), 8);
}

TEST_F(WorkerTest, WaitsForItsTasksAtTheEnd) {
  set_thread_count(2);
  int done = 0;
  {
    Worker worker;
    for (int i = 0; i < 10; ++i)
      worker.run([&done] {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ++done;
      });
  }
  EXPECT_EQ(done, 10);
}

}  // namespace
}  // namespace polymorph
