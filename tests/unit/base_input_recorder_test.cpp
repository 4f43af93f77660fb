#include "base/input_recorder.h"

#include <gtest/gtest.h>

#include "base/file.h"
#include "base/parallel.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

// SHA-256 of "abc" (FIPS 180-4, its first example) and of nothing.
constexpr const char* kAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr const char* kEmpty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

using InputRecorderTest = FolderTest;

TEST_F(InputRecorderTest, ListsWhatWasReadWithItsDigest) {
  ASSERT_TRUE(write_file(folder / "sub/abc", "abc"));
  ASSERT_TRUE(write_file(folder / "empty", ""));
  ASSERT_TRUE(write_file(folder / "before", "x"));
  ASSERT_TRUE(read_file(folder / "before"));
  InputRecorder recorder;
  ASSERT_TRUE(read_file(folder / "sub/../sub/abc"));
  ASSERT_TRUE(read_file(folder / "sub/abc"));
  ASSERT_TRUE(read_file(folder / "empty"));
  EXPECT_FALSE(read_file(folder / "missing"));
  const std::vector<ReadFile> files = recorder.files();
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].path, folder / "empty");
  EXPECT_EQ(files[0].sha256, kEmpty);
  EXPECT_EQ(files[1].path, folder / "sub/abc");
  EXPECT_EQ(files[1].sha256, kAbc);
}

TEST_F(InputRecorderTest, ReadsRegisteredFilesItself) {
  ASSERT_TRUE(write_file(folder / "abc", "abc"));
  InputRecorder recorder;
  remember_input(folder / "abc");
  remember_input(folder / "missing");
  remember_input(folder);
  remember_input("");
  const std::vector<ReadFile> files = recorder.files();
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(files[0].path, folder / "abc");
  EXPECT_EQ(files[0].sha256, kAbc);
}

TEST_F(InputRecorderTest, HearsAllThreadsAndOthersBesideIt) {
  InputRecorder outer;
  {
    InputRecorder inner;
    parallel_for(64, [&](std::int64_t i) {
      const auto file = folder / std::to_string(i);
      PM_CHECK(write_file(file, "abc").ok());
      PM_CHECK(read_file(file).ok());
    });
    EXPECT_EQ(inner.files().size(), 64u);
  }
  ASSERT_TRUE(write_file(folder / "after", ""));
  ASSERT_TRUE(read_file(folder / "after"));
  EXPECT_EQ(outer.files().size(), 65u);
}

}  // namespace
}  // namespace polymorph
