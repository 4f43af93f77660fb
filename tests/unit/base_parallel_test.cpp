#include "base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>

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

}  // namespace
}  // namespace polymorph
