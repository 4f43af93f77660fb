#include "base/frames.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/file.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

std::vector<int> frames(const char* text, int last = 100) {
  const auto list = parse_frames(text, 1, last);
  EXPECT_TRUE(list.ok()) << text << ": " << (list.ok() ? "" : list.error().message);
  return list.ok() ? *list : std::vector<int>{};
}

TEST(ParseFrames, FollowsOiiotoolsGrammar) {
  EXPECT_EQ(frames("7"), (std::vector<int>{7}));
  EXPECT_EQ(frames("1-4"), (std::vector<int>{1, 2, 3, 4}));
  EXPECT_EQ(frames("1..3"), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(frames("4-1"), (std::vector<int>{4, 3, 2, 1}));
  EXPECT_EQ(frames("1-9x4"), (std::vector<int>{1, 5, 9}));
  EXPECT_EQ(frames("1-5y2"), (std::vector<int>{2, 4}));
  EXPECT_EQ(frames("9-1x4"), (std::vector<int>{9, 5, 1}));
  EXPECT_EQ(frames("5,1-3,2"), (std::vector<int>{5, 1, 2, 3}))
      << "duplicates are dropped, the order stays";
}

TEST(ParseFrames, RefusesWhatItCannotMean) {
  for (const char* bad :
       {"", "a", "1-", "-3", "1-4x0", "1-4x", "1,,2", "1-2-3", "0", "101", "90-110", "3-3y1"}) {
    const auto list = parse_frames(bad, 1, 100);
    EXPECT_FALSE(list.ok()) << bad;
    if (!list.ok()) {
      EXPECT_EQ(list.error().code, ErrorCode::kUsage);
    }
  }
}

TEST(ParsePattern, HashesAndPrintf) {
  EXPECT_EQ(frame_path(*parse_pattern("out/f.####.exr"), 7), "out/f.0007.exr");
  EXPECT_EQ(frame_path(*parse_pattern("f%04d.png"), 12345), "f12345.png");
  EXPECT_EQ(frame_path(*parse_pattern("100%%.###.exr"), 7), "100%.007.exr");
  EXPECT_EQ(frame_path(*parse_pattern("one.exr"), 7), "one.exr");
  EXPECT_EQ(frame_path(add_number(*parse_pattern("a.b/one.exr")), 7), "a.b/one.0007.exr");
  EXPECT_EQ(frame_path(add_number(*parse_pattern("a.b/one")), 7), "a.b/one.0007");
  EXPECT_EQ(frame_path(with_extension(*parse_pattern("o.x/f.##.exr"), ".png"), 7), "o.x/f.07.png");
  EXPECT_EQ(frame_path(with_extension(*parse_pattern("one.exr"), ".png"), 7), "one.png");
}

TEST(ParsePattern, RefusesAmbiguousNames) {
  for (const char* bad : {"f.#.exr", "f.##.##.exr", "f.####.%04d.exr", "out##/f.exr", "out/",
                          "f%d.exr", "f%4d.exr", "f%x.exr"}) {
    const auto pattern = parse_pattern(bad);
    EXPECT_FALSE(pattern.ok()) << bad;
    if (!pattern.ok()) {
      EXPECT_EQ(pattern.error().code, ErrorCode::kUsage);
    }
  }
  EXPECT_NE(parse_pattern("f.#.exr").error().message.find("####"), std::string::npos);
}

TEST(ExistingFrames, FindsOnlyNamesOfThePattern) {
  const TemporaryFolder temporary;
  const auto& folder = temporary.path();
  for (const char* name : {"f.0001.exr", "f.0012.exr", "f.7.exr", "f.0003.png", "g.0001.exr",
                           "f.x.exr", "f.10000.exr"})
    ASSERT_TRUE(write_file(folder / name, "x").ok());
  const auto found = existing_frames(*parse_pattern((folder / "f.####.exr").string()));
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(*found, (std::vector<int>{1, 12, 10000}));
}

TEST(Shards, InterleaveAndCoverEverythingOnce) {
  const std::vector<int> all{1, 2, 3, 4, 5, 6, 7};
  std::vector<int> seen;
  for (int i = 1; i <= 3; ++i)
    for (const int frame : take_shard(all, {i, 3})) seen.push_back(frame);
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(seen, all);
  EXPECT_EQ(take_shard(all, {2, 3}), (std::vector<int>{2, 5}));
  for (const char* bad : {"0/3", "4/3", "1/0", "x", "1", "1/"})
    EXPECT_FALSE(parse_shard(bad).ok()) << bad;
}

TEST(Shards, AutoReadsSlurmsArray) {
  ::setenv("SLURM_ARRAY_TASK_ID", "14", 1);
  ::setenv("SLURM_ARRAY_TASK_MIN", "10", 1);
  ::setenv("SLURM_ARRAY_TASK_STEP", "2", 1);
  ::setenv("SLURM_ARRAY_TASK_COUNT", "5", 1);
  const auto shard = parse_shard("auto");
  for (const char* name : {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_STEP",
                           "SLURM_ARRAY_TASK_COUNT"})
    ::unsetenv(name);
  ASSERT_TRUE(shard.ok());
  EXPECT_EQ(shard->index, 3);
  EXPECT_EQ(shard->count, 5);
}

TEST(Shards, AutoReadsWhatMpiRunnersSay) {
  const auto shard_with = [](const char* rank_name, const char* rank, const char* size_name,
                             const char* size) {
    for (const char* name : {"SLURM_ARRAY_TASK_ID", "OMPI_COMM_WORLD_RANK", "PMI_RANK"})
      ::unsetenv(name);
    if (rank) ::setenv(rank_name, rank, 1);
    if (size) ::setenv(size_name, size, 1);
    auto shard = parse_shard("auto");
    for (const char* name : {rank_name, size_name}) ::unsetenv(name);
    return shard;
  };
  for (const auto& [rank, size] : {std::pair("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"),
                                   std::pair("PMI_RANK", "PMI_SIZE")}) {
    const auto last = shard_with(rank, "3", size, "4");  // ranks count from 0
    ASSERT_TRUE(last.ok()) << rank;
    EXPECT_EQ(last->index, 4);
    EXPECT_EQ(last->count, 4);
    EXPECT_FALSE(shard_with(rank, "3", size, nullptr).ok()) << "how many there are is not said";
    EXPECT_FALSE(shard_with(rank, "4", size, "4").ok());
    EXPECT_FALSE(shard_with(rank, "-1", size, "4").ok());
    EXPECT_FALSE(shard_with(rank, nullptr, size, "4").ok()) << "no runner";
  }
}

}  // namespace
}  // namespace polymorph
