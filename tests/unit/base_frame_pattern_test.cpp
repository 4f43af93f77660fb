#include "base/frame_pattern.h"

#include <gtest/gtest.h>

#include "base/file.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

using FilePattern = FolderTest;

TEST_F(FilePattern, TakesTheNumberFromTheFilesNameAlone) {
  const auto pattern = parse_file_pattern("/films/shot #1/100%/seq.####.obj");
  ASSERT_TRUE(pattern.ok()) << pattern.error().message;
  EXPECT_EQ(frame_path(*pattern, 7), "/films/shot #1/100%/seq.0007.obj");
  EXPECT_EQ(frame_path(*parse_file_pattern("seq.%03d.ply"), 7), "seq.007.ply");
  EXPECT_FALSE(parse_file_pattern("/a/plain.obj")->has_number());
  EXPECT_FALSE(parse_file_pattern("/a/one.#.obj").ok());
}

TEST_F(FilePattern, FindsTheFilesOfItsFolder) {
  for (const char* name : {"s_08.obj", "s_10.obj", "s_9.obj", "s_11.ply"})
    ASSERT_TRUE(write_file(folder / name, "").ok());
  EXPECT_EQ(*existing_frames(*parse_file_pattern(folder / "s_##.obj")), (std::vector{8, 10}));
}

}  // namespace
}  // namespace polymorph
