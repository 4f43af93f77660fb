#include <gtest/gtest.h>

#include "image/image.h"
#include "image/strip.h"

namespace polymorph {
namespace {

Image ramp(int width, int height) {
  Image image = make_image(width, height, {"R", "Z"});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      image.at(x, y, 0) = static_cast<float>(x);
      image.at(x, y, 1) = static_cast<float>(y);
    }
  return image;
}

TEST(ResizeImage, EachPixelIsTheMeanOverItsArea) {
  const Image small = resize_image(ramp(8, 6), 4, 2);
  ASSERT_EQ(small.width, 4);
  ASSERT_EQ(small.height, 2);
  EXPECT_EQ(small.channels, (std::vector<std::string>{"R", "Z"}));
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 4; ++x) {
      EXPECT_FLOAT_EQ(small.at(x, y, 0), 2 * static_cast<float>(x) + 0.5f);
      EXPECT_FLOAT_EQ(small.at(x, y, 1), 3 * static_cast<float>(y) + 1);
    }
}

TEST(ResizeImage, SharesPixelsThatLieAcrossABorder) {
  const Image small = resize_image(ramp(3, 1), 2, 1);  // 1.5 pixels each
  EXPECT_FLOAT_EQ(small.at(0, 0, 0), (0 + 0.5f * 1) / 1.5f);
  EXPECT_FLOAT_EQ(small.at(1, 0, 0), (0.5f * 1 + 2) / 1.5f);
}

TEST(ResizeImage, EnlargesWithoutNewValues) {
  const Image large = resize_image(ramp(2, 2), 6, 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) EXPECT_FLOAT_EQ(large.at(x, y, 0), x < 3 ? 0 : 1);
}

TEST(ResizeImage, KeepsTheMean) {
  const Image image = ramp(37, 23), small = resize_image(image, 11, 7);
  const auto mean = [](const Image& of) {
    double sum = 0;
    for (int y = 0; y < of.height; ++y)
      for (int x = 0; x < of.width; ++x) sum += static_cast<double>(of.at(x, y, 0));
    return sum / of.width / of.height;
  };
  EXPECT_NEAR(mean(small), mean(image), 1e-4);
}

}  // namespace
}  // namespace polymorph
