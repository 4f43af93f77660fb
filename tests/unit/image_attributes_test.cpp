#include "image/attributes.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

TEST(Attributes, AreFoundByName) {
  Image image;
  image.attributes = {{"a", std::string("text")}, {"b", 12}, {"c", 0.5f}};
  EXPECT_EQ(find_text(image, "a"), "text");
  EXPECT_EQ(find_text(image, "b"), "");
  EXPECT_EQ(find_text(image, "d"), "");
  EXPECT_EQ(format_entry(image, "a"), "text");
  EXPECT_EQ(format_entry(image, "b"), "12");
  EXPECT_EQ(format_entry(image, "c"), "0.5");
  EXPECT_EQ(format_entry(image, "d"), std::nullopt);
}

}  // namespace
}  // namespace polymorph
