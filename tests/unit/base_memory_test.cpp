#include "base/memory.h"
#include "testing/temporary_folder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <limits>
#include <vector>

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class Memory : public FolderTest {
 protected:
  void write(const fs::path& name, const char* text) {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  }
};

TEST_F(Memory, OfACgroupIsTheLeastOfItsOwnAndThoseAboveIt) {
  EXPECT_EQ(cgroup_memory_limit("0::/job/step\n", folder), std::nullopt);
  write("job/step/memory.max", "max\n");
  EXPECT_EQ(cgroup_memory_limit("0::/job/step\n", folder), std::nullopt);
  write("job/memory.max", "3000000000\n");
  EXPECT_EQ(cgroup_memory_limit("0::/job/step\n", folder), 3000000000u);
  write("job/step/memory.max", "4000000000\n");
  EXPECT_EQ(cgroup_memory_limit("0::/job/step\n", folder), 3000000000u);
  write("job/step/memory.max", "2000000000\n");
  EXPECT_EQ(cgroup_memory_limit("0::/job/step\n", folder), 2000000000u);
  // A sibling's is none of ours; in a container the own cgroup may be the root.
  EXPECT_EQ(cgroup_memory_limit("0::/job/other\n", folder), 3000000000u);
  write("memory.max", "1000000000\n");
  EXPECT_EQ(cgroup_memory_limit("0::/../elsewhere\n", folder), 1000000000u);
}

TEST_F(Memory, OfVersionOneCgroupsIsReadToo) {
  const char* both = "12:cpuset:/\n4:hugetlb,memory:/job\n0::/\n";
  write("memory/memory.limit_in_bytes", "9223372036854771712\n");
  write("memory/job/memory.limit_in_bytes", "5000000000\n");
  EXPECT_EQ(cgroup_memory_limit(both, folder), 5000000000u);
  write("unified/memory.max", "4000000000\n");
  EXPECT_EQ(cgroup_memory_limit(both, folder), 4000000000u);
  EXPECT_EQ(cgroup_memory_limit("no cgroups\n", folder), std::nullopt);
}

TEST_F(Memory, OfTheProcessIsNoMoreThanSlurmAndUlimitGive) {
  const std::uint64_t machine = memory_limit();
  EXPECT_GT(machine, 100u << 20);
  setenv("SLURM_MEM_PER_NODE", "64", 1);
  EXPECT_EQ(memory_limit(), 64u << 20);
  setenv("SLURM_MEM_PER_NODE", "0", 1);
  EXPECT_EQ(memory_limit(), machine);
  unsetenv("SLURM_MEM_PER_NODE");
}

TEST_F(Memory, RemainsUntilTheBudgetIsUsed) {
  EXPECT_EQ(remaining_memory(), std::numeric_limits<std::uint64_t>::max());
  set_memory_budget(1);
  EXPECT_EQ(remaining_memory(), 0u);
  constexpr std::uint64_t kBudget = std::uint64_t{1} << 40;
  set_memory_budget(kBudget);
  const std::uint64_t before = remaining_memory();
  EXPECT_LT(before, kBudget);
  const std::vector<char> taken(64 << 20, 'x');
  EXPECT_LT(remaining_memory() + (60u << 20), before);
  EXPECT_EQ(taken.back(), 'x');
  set_memory_budget(0);
}

}  // namespace
}  // namespace polymorph
