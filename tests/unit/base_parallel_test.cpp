#include "base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/side_by_side.h"
#include "kernels/interruption.h"

namespace polymorph {
namespace {

class Interruption : public ::testing::Test {
 protected:
  void TearDown() override { clear_interruption(); }
};

TEST_F(Interruption, EndsAParallelLoop) {
  std::atomic<int> count{0};
  EXPECT_THROW(parallel_for(1000000,
                            [&](std::int64_t) {
                              if (++count == 10) request_interruption();
                            }),
               Interrupted);
  EXPECT_LT(count, 1000000);
  EXPECT_TRUE(is_interrupted());
  EXPECT_THROW(check_interruption(), Interrupted);
}

TEST_F(Interruption, LoopsRunAgainAfterwards) {
  request_interruption();
  clear_interruption();
  std::atomic<int> count{0};
  parallel_for(100, [&](std::int64_t) { ++count; });
  EXPECT_EQ(count, 100);
  EXPECT_FALSE(is_interrupted());
}

TEST_F(Interruption, HasAGraceOfProcessorTime) {
  request_interruption(0.05);
  EXPECT_FALSE(is_interrupted());
  check_interruption();
  volatile double sum = 0;
  EXPECT_THROW(
      {
        for (int i = 0; i < 2000000000; ++i) {
          sum = sum + 1;
          if (i % 1000 == 0) check_interruption();
        }
      },
      Interrupted);
}

TEST(SideBySide, BothPartsEndBeforeTheCallReturns) {
  std::atomic<std::int64_t> sum{0};
  const auto add_numbers = [&](std::int64_t count) {
    parallel_for(count, [&](std::int64_t i) { sum += i; });
  };
  run_side_by_side([&] { add_numbers(1000); },
                   [&] { run_side_by_side([&] { add_numbers(2000); }, [&] { add_numbers(10); }); });
  EXPECT_EQ(sum, 999 * 1000 / 2 + 1999 * 2000 / 2 + 9 * 10 / 2);
}

TEST(SideBySide, EachOfManyPartsRunsOnce) {
  std::vector<std::atomic<int>> calls(50);
  std::atomic<std::int64_t> sum{0};
  run_all_side_by_side(50, [&](std::int64_t part) {
    ++calls[static_cast<std::size_t>(part)];
    parallel_for(100, [&](std::int64_t i) { sum += i; });
  });
  for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1);
  EXPECT_EQ(sum, 50 * 99 * 100 / 2);
}

TEST(SideBySide, APartThatThrowsEndsTheCall) {
  const auto fail = [] { throw std::runtime_error("no room"); };
  EXPECT_THROW(run_side_by_side(fail, [] {}), std::runtime_error);
  EXPECT_THROW(run_side_by_side([] {}, fail), std::runtime_error);
}

TEST(SideBySide, APartThatThrowsCancelsNoLoopOfTheOther) {
  std::atomic<bool> has_thrown{false};
  std::atomic<int> calls{0};
  const auto fail = [&] {
    has_thrown = true;
    throw std::runtime_error("no room");
  };
  const auto work = [&] {
    for (int i = 0; i < 2000 && !has_thrown; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // until the exception has spread
    parallel_for(1000, [&](std::int64_t) { ++calls; });
  };
  EXPECT_THROW(run_side_by_side(work, fail), std::runtime_error);
  EXPECT_EQ(calls, 1000);
  calls = 0, has_thrown = false;
  EXPECT_THROW(run_all_side_by_side(2, [&](std::int64_t i) { i == 0 ? work() : fail(); }),
               std::runtime_error);
  EXPECT_EQ(calls, 1000);
}

TEST(SideBySide, AThreadThatWaitsInOnePartTakesUpNothingOfTheOther) {
  // Each thread counts the parts that it is in. A thread that took up the other part while it waits
  // for its loop would be in both.
  static thread_local int depth;
  std::atomic<int> deepest{0};
  const auto part = [&] {
    const int own = ++depth;
    parallel_for(64, [&](std::int64_t) {
      volatile double sum = 0;
      for (int i = 0; i < 20000; ++i) sum = sum + 1;
    });
    --depth;
    int seen = deepest;
    while (seen < own && !deepest.compare_exchange_weak(seen, own)) {
    }
  };
  for (int i = 0; i < 50; ++i) run_side_by_side(part, part);
  EXPECT_EQ(deepest, 1);
}

}  // namespace
}  // namespace polymorph
