#include "base/archive.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

#include "base/file.h"
#include "base/text.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class Archive : public FolderTest {
 protected:
  void SetUp() override {
    fs::create_directories(folder / "tree/deep");
    ASSERT_TRUE(write_file(folder / "tree/a.exr", "first").ok());
    ASSERT_TRUE(write_file(folder / "tree/deep/b.exr", std::string(100000, 'b')).ok());
    ASSERT_TRUE(write_file(folder / "tree/notes.txt", "not wanted").ok());
    fs::create_symlink("a.exr", folder / "tree/link.exr");
    ASSERT_EQ(std::system(("tar -czf '" + (folder / "tree.tgz").string() + "' -C '" +
                           (folder / "tree").string() + "' .")
                              .c_str()),
              0);
  }
  static bool is_exr(const std::string& name) { return name.ends_with(".exr"); }
};

TEST_F(Archive, APipeIsNotWaitedFor) {
  ASSERT_EQ(::mkfifo((folder / "pipe.zip").c_str(), 0600), 0);
  const auto files = read_tree(folder / "pipe.zip", is_exr);
  ASSERT_FALSE(files.ok());
  EXPECT_EQ(files.error().message, (folder / "pipe.zip").string() + ": is not a regular file");
}

TEST_F(Archive, FoldersAndArchivesHaveTheSameFiles) {
  const std::map<std::string, std::string> wanted{{"a.exr", "first"},
                                                  {"deep/b.exr", std::string(100000, 'b')}};
  for (const char* name : {"tree", "tree.tgz"}) {
    const auto files = read_tree(folder / name, is_exr);
    ASSERT_TRUE(files.ok()) << files.error().message;
    EXPECT_EQ(*files, wanted) << name;
  }
}

TEST_F(Archive, LineBreaksInItsNamesEndNoLineOfAMessage) {
  ASSERT_TRUE(write_file(folder / "tree/c\nd.exr", "third").ok());
  ASSERT_EQ(std::system(("tar -czf '" + (folder / "odd.tgz").string() + "' -C '" +
                         (folder / "tree").string() + "' 'c\nd.exr'")
                            .c_str()),
            0);
  fs::remove(folder / "tree/c\nd.exr");
  ASSERT_TRUE(read_tree(folder / "odd.tgz", is_exr).ok());
  EXPECT_EQ(printable("c\nd.exr: cannot be read", LineBreaks::kKeep), "c?d.exr: cannot be read");
}

TEST_F(Archive, WhatIsTooLargeOrBrokenIsRefused) {
  for (const char* name : {"tree", "tree.tgz"}) {
    EXPECT_TRUE(read_tree(folder / name, is_exr, 100005).ok()) << name;
    EXPECT_EQ(read_tree(folder / name, is_exr, 100004).error().code, ErrorCode::kInput) << name;
  }
  EXPECT_EQ(read_tree(folder / "gone.zip", is_exr).error().code, ErrorCode::kInput);
  EXPECT_EQ(read_tree(folder / "tree/notes.txt", is_exr).error().code, ErrorCode::kInput);
  const std::string whole = *read_file(folder / "tree.tgz");
  ASSERT_TRUE(write_file(folder / "cut.tgz", whole.substr(0, whole.size() / 2)).ok());
  EXPECT_EQ(read_tree(folder / "cut.tgz", is_exr).error().code, ErrorCode::kInput);
}

}  // namespace
}  // namespace polymorph
