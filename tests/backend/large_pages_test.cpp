#include "kernels/large_pages.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace polymorph {
namespace {

/// Tests whether the system may use large pages for this address: the flag "hg" of its mapping.
bool has_large_pages(const void* address) {
  std::ifstream file("/proc/self/smaps");
  bool is_inside = false;
  for (std::string line; std::getline(file, line);) {
    std::uint64_t begin = 0, end = 0;
    char dash = 0;
    std::istringstream range(line);
    if (range >> std::hex >> begin >> dash >> end && dash == '-') {
      const auto at = reinterpret_cast<std::uintptr_t>(address);
      is_inside = begin <= at && at < end;
    }
    if (is_inside && line.starts_with("VmFlags:")) return line.find(" hg") != std::string::npos;
  }
  return false;
}

/// Tests whether the system has large pages and says where they are asked for. An emulator does
/// not.
bool shows_large_pages() {
  constexpr std::size_t kBytes = std::size_t{4} << 20;
  void* memory =
      ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return false;
  const bool is_shown = ::madvise(memory, kBytes, MADV_HUGEPAGE) == 0 && has_large_pages(memory);
  ::munmap(memory, kBytes);
  return is_shown;
}

TEST(LargePages, AVectorOfThemHoldsZeros) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{5} << 20}) {
    const auto values = make_large_vector<float>(count);
    EXPECT_EQ(values.size(), count);
    EXPECT_TRUE(std::all_of(values.begin(), values.end(), [](float v) { return v == 0; }));
  }
}

TEST(LargePages, AreRequestedInsideLargeArraysOnly) {
  if (!shows_large_pages()) GTEST_SKIP() << "this system shows no large pages";
  constexpr std::size_t kBytes = std::size_t{64} << 20;
  const auto large = make_large_vector<char>(kBytes);
  EXPECT_TRUE(has_large_pages(large.data() + kBytes / 2));
  constexpr std::size_t kSmall = std::size_t{1} << 20;
  // The heap may give memory again that an earlier test has freed, with the request.
  if (has_large_pages(std::vector<char>(kSmall).data() + kSmall / 2))
    GTEST_SKIP() << "small arrays are in memory of a freed large one";
  const auto small = make_large_vector<char>(kSmall);
  EXPECT_FALSE(has_large_pages(small.data() + small.size() / 2));
}

}  // namespace
}  // namespace polymorph
