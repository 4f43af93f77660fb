#include "scene/input_names.h"

#include <gtest/gtest.h>
#include <stdlib.h>

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class InputNamesTest : public ::testing::Test {
 protected:
  void SetUp() override { ::setenv("HOME", "/home/ada", 1); }
  void TearDown() override { ::setenv("HOME", home_.c_str(), 1); }

  static std::vector<std::string> names(const fs::path& scene, const std::vector<fs::path>& files) {
    const InputNames chosen = choose_names(scene, files);
    std::vector<std::string> all;
    for (const fs::path& file : files) all.push_back(chosen.name(file));
    return all;
  }

 private:
  std::string home_ = ::getenv("HOME") ? ::getenv("HOME") : "/";
};

using Names = std::vector<std::string>;

TEST_F(InputNamesTest, BeginAtTheSceneWhereAllLieBelowIt) {
  EXPECT_EQ(names("/home/ada/film", {"/home/ada/film/models/a.obj", "/home/ada/film/b.obj"}),
            (Names{"models/a.obj", "b.obj"}));
}

TEST_F(InputNamesTest, BeginAtTheCommonFolderElse) {
  EXPECT_EQ(names("/p/scenes/golden", {"/p/scenes/models/a.obj", "/p/scenes/models/t/a.png"}),
            (Names{"a.obj", "t/a.png"}));
  EXPECT_EQ(names("/p/film", {"/p/film/a.obj", "/p/sky/s.hdr"}),
            (Names{"film/a.obj", "sky/s.hdr"}));
  EXPECT_EQ(names("/q", {"/p/a.obj"}), (Names{"a.obj"}));
}

TEST_F(InputNamesTest, NeverTellTheUser) {
  // Below the file system's root, and in folders of two users.
  EXPECT_EQ(names("/home/ada/film", {"/home/ada/film/a.obj", "/srv/ada/b.obj", "/srv/ada/t/c.png"}),
            (Names{"1/a.obj", "2/b.obj", "2/t/c.png"}));
  EXPECT_EQ(names("/home/ada", {"/home/ada/a.obj", "/home/bob/b.obj"}),
            (Names{"1/a.obj", "2/b.obj"}));
  EXPECT_EQ(names("/srv", {"/srv/x.obj", "/srv/ada/y.obj"}), (Names{"1/x.obj", "2/y.obj"}));
  EXPECT_EQ(names("/", {"/x.obj", "/y/ada/y.obj"}), (Names{"1/x.obj", "2/y.obj"}));
}

TEST_F(InputNamesTest, AreLastNamesOutsideTheRoots) {
  EXPECT_EQ(InputNames{}.name("/a/b.obj"), "b.obj");
  EXPECT_EQ((InputNames{{"/a"}}).name("/ab/c.obj"), "c.obj");
  EXPECT_TRUE(choose_names("/a", {}).roots.empty());
}

TEST_F(InputNamesTest, AreSafeBelowTheirFolder) {
  for (const char* name : {"a.obj", "t/a.png", "1/my tree.obj", "seq.####.obj", "...", "#"})
    EXPECT_TRUE(is_safe_name(name)) << name;
  for (const char* name : {"", "/a", "..", "../a", "a/../b", "a/..", "./a", "a//b", "a/", "a\nb"})
    EXPECT_FALSE(is_safe_name(name)) << name;
  EXPECT_FALSE(is_safe_name(std::string("a\0b", 3)));
  EXPECT_FALSE(is_safe_name(std::string(2000, 'a')));
}

}  // namespace
}  // namespace polymorph
