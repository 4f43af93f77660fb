#include "base/thread_failure.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <system_error>

namespace polymorph {
namespace {

TEST(ThreadFailure, IsWhatTheStandardLibraryThrows) {
  EXPECT_TRUE(is_thread_failure(
      std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again))));
  EXPECT_FALSE(
      is_thread_failure(std::system_error(std::make_error_code(std::errc::permission_denied))));
}

TEST(ThreadFailure, IsWhatTbbThrows) {
  EXPECT_TRUE(is_thread_failure(
      std::runtime_error("pthread_create has failed: Resource temporarily unavailable")));
  EXPECT_FALSE(is_thread_failure(std::runtime_error("no such model")));
}

}  // namespace
}  // namespace polymorph
