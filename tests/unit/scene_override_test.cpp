#include "scene/override.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

TEST(Override, ValuesAreSetByTheirPath) {
  auto document = parse_json("file", R"({"image": {"width": 1}, "list": [{"a": 1}]})");
  ASSERT_TRUE(document);
  EXPECT_TRUE(apply_override(*document, "image.width", "640"));
  EXPECT_TRUE(apply_override(*document, "look.kind", "metal"));  // no JSON: a string
  EXPECT_TRUE(apply_override(*document, "list.0.a", "[1, 2]"));
  const JsonValue& root = document->root;
  EXPECT_EQ(root.find("image")->find("width")->integer, 640);
  EXPECT_EQ(root.find("look")->find("kind")->string, "metal");
  EXPECT_EQ(root.find("list")->items[0].find("a")->items.size(), 2u);
  EXPECT_TRUE(apply_override(*document, "target", "b.obj"));
  EXPECT_TRUE(apply_override(*document, "target.scale", "2"));
  EXPECT_EQ(document->root.find("target")->find("")->string, "b.obj");
  EXPECT_EQ(document->root.find("target")->find("scale")->integer, 2);
  const auto bad = apply_override(*document, "list.7.a", "1");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::kUsage);
}

}  // namespace
}  // namespace polymorph
