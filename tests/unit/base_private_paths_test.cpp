#include "base/private_paths.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <string>

namespace polymorph {
namespace {

class PrivatePaths : public ::testing::Test {
 protected:
  void SetUp() override { ::setenv("HOME", "/home/ada", 1); }
  void TearDown() override { ::setenv("HOME", home_.c_str(), 1); }

 private:
  std::string home_ = ::getenv("HOME") ? ::getenv("HOME") : "/";
};

TEST_F(PrivatePaths, LoseTheirFolders) {
  for (const auto& [text, wanted] : {
           std::pair("/home/ada/film/scene.json", "scene.json"),
           std::pair("-o/home/ada/f.exr", "-of.exr"),
           std::pair("--cache-dir=/home/ada", "--cache-dir=~"),
           std::pair("/home/ada/", "~"),
           std::pair("lights.environment=\"/home/ada/my sky.hdr\"",
                     "lights.environment=\"my sky.hdr\""),
           std::pair("[\"/a/b\",\"/c/d\"]", "[\"b\",\"d\"]"),
           std::pair("/a/b:/c/d", "b:d"),
           std::pair("/home/ada/my films/out/frame.####.exr", "frame.####.exr"),
           std::pair("../film/scene.json", "../film/scene.json"),
           std::pair("film/scene.json", "film/scene.json"),
           std::pair("image.samples=4", "image.samples=4"),
           std::pair("1/8", "1/8"),
           std::pair("/", ""),
       })
    EXPECT_EQ(remove_folders(text), wanted) << text;
}

TEST_F(PrivatePaths, KnowTheUser) {
  EXPECT_TRUE(is_private_folder("ada"));
  EXPECT_FALSE(is_private_folder("home"));
  EXPECT_FALSE(is_private_folder(""));
  ::setenv("HOME", "/home/ada/", 1);
  EXPECT_TRUE(is_private_folder("ada"));
}

}  // namespace
}  // namespace polymorph
