#include <gtest/gtest.h>

#include <set>

#include "image/font.h"
#include "image/image_io.h"
#include "image/strip.h"
#include "testing/image.h"

namespace polymorph {
namespace {

std::vector<Image> grey_frames(int count, int width, int height) {
  std::vector<Image> frames;
  for (int i = 0; i < count; ++i) {
    frames.push_back(make_image(width, height, {"R", "G", "B"}));
    for (float& value : frames.back().pixels) value = 0.1f * static_cast<float>(i + 1);
  }
  return frames;
}

TEST(Strip, PlacesFramesRowByRow) {
  const auto frames = grey_frames(5, 20, 10);
  const auto sheet = make_strip(frames, {}, {.columns = 3, .gap = 4, .background = 0.5f});
  ASSERT_TRUE(sheet);
  EXPECT_EQ(sheet->width, 3 * 24 + 4);
  EXPECT_EQ(sheet->height, 2 * 14 + 4);
  for (int i = 0; i < 5; ++i) {
    const int left = 4 + i % 3 * 24, top = 4 + i / 3 * 14;
    EXPECT_EQ(sheet->at(left, top, 0), frames[static_cast<std::size_t>(i)].pixels[0]);
    EXPECT_EQ(sheet->at(left + 19, top + 9, 2), frames[static_cast<std::size_t>(i)].pixels[0]);
    EXPECT_EQ(sheet->at(left - 1, top, 1), 0.5f);
  }
  EXPECT_EQ(sheet->at(4 + 2 * 24, 4 + 14, 0), 0.5f) << "the sixth cell is empty";
}

TEST(Strip, LabelsAreCentredBelowTheirFrames) {
  const auto frames = grey_frames(2, 60, 20);
  const std::vector<std::string> labels{"frame 1", "frame 2"};
  const auto sheet = make_strip(frames, labels, {.columns = 2, .gap = 6});
  ASSERT_TRUE(sheet);
  const Image plain = *make_strip(frames, {}, {.columns = 2, .gap = 6});
  EXPECT_GT(sheet->height, plain.height);
  int left = sheet->width, right = -1;
  for (int y = 6 + 20; y < sheet->height; ++y)
    for (int x = 0; x < 6 + 60; ++x)
      if (sheet->at(x, y, 0) > 0.3f) {
        left = std::min(left, x);
        right = std::max(right, x);
      }
  EXPECT_NEAR(left + right, 2 * 6 + 60 - 1, 1);
  EXPECT_NEAR(right - left + 1, text_width("frame 1"), 1);
}

TEST(Strip, ALabelNeverLeavesItsCell) {
  const auto frames = grey_frames(2, 30, 20);
  const std::vector<std::string> labels{"a very long label that cannot fit", ""};
  const auto sheet = make_strip(frames, labels, {.columns = 2, .gap = 6});
  ASSERT_TRUE(sheet);
  for (int y = 26; y < sheet->height; ++y)
    for (int x = 36; x < sheet->width; ++x) EXPECT_EQ(sheet->at(x, y, 0), 0.02f);
}

TEST(Strip, ShowsTheBackgroundThroughTransparentPixels) {
  Image frame = make_image(4, 4, {"R", "G", "B", "A"});
  frame.at(1, 1, 0) = 0.3f;  // premultiplied
  frame.at(1, 1, 3) = 0.5f;
  const auto sheet = make_strip(std::vector<Image>{frame}, {}, {.gap = 1, .background = 0.2f});
  ASSERT_TRUE(sheet);
  EXPECT_FLOAT_EQ(sheet->at(2, 2, 0), 0.4f);
  EXPECT_FLOAT_EQ(sheet->at(1, 1, 0), 0.2f);
}

TEST(Strip, RefusesWhatDoesNotFitTogether) {
  EXPECT_FALSE(make_strip({}, {}));
  auto frames = grey_frames(2, 8, 8);
  EXPECT_FALSE(make_strip(frames, std::vector<std::string>{"one"}));
  frames.push_back(make_image(8, 9, {"R", "G", "B"}));
  const auto mixed = make_strip(frames, {});
  ASSERT_FALSE(mixed);
  EXPECT_EQ(mixed.error().code, ErrorCode::kInput);
  EXPECT_NE(mixed.error().message.find("8 x 9"), std::string::npos);
}

TEST(Resize, KeepsTheMean) {
  const Image image = random_image(37, 23, {"R", "Z"});
  const auto mean = [](const Image& i, int c) {
    double sum = 0;
    for (int y = 0; y < i.height; ++y)
      for (int x = 0; x < i.width; ++x) sum += static_cast<double>(i.at(x, y, c));
    return sum / (i.width * i.height);
  };
  for (const auto& [width, height] : {std::pair{10, 7}, {37, 23}, {80, 61}, {1, 1}}) {
    const Image resized = resize_image(image, width, height);
    EXPECT_EQ(resized.width, width);
    EXPECT_EQ(resized.height, height);
    for (int c = 0; c < 2; ++c) EXPECT_NEAR(mean(resized, c), mean(image, c), 1e-5);
  }
}

TEST(Resize, AveragesWholePixels) {
  Image image = make_image(4, 2, {"R"});
  image.pixels = {1, 3, 5, 7, 2, 4, 6, 8};
  EXPECT_EQ(resize_image(image, 2, 1).pixels, (std::vector<float>{2.5f, 6.5f}));
  EXPECT_EQ(resize_image(image, 8, 2).pixels,
            (std::vector<float>{1, 1, 3, 3, 5, 5, 7, 7, 2, 2, 4, 4, 6, 6, 8, 8}));
}

TEST(Font, EveryPrintableCharacterIsDrawnAndDifferent) {
  std::set<std::vector<int>> shapes;
  for (char c = 33; c < 127; ++c) {
    const Glyph& glyph = find_glyph(c);
    EXPECT_GE(glyph.width, 1) << c;
    EXPECT_LE(glyph.width, 6) << c;
    shapes.insert(std::vector<int>(glyph.rows.begin(), glyph.rows.end()));
  }
  EXPECT_EQ(shapes.size(), 94u);
  for (char c = '0'; c <= '9'; ++c) EXPECT_EQ(find_glyph(c).width, 5) << "digits must line up";
}

TEST(Font, TextIsClippedAndOnlyDrawnOnColours) {
  Image image = make_image(10, 10, {"R", "G", "B", "Z"});
  draw_text(image, -3, -4, "MMMM", {0.5f, 2});
  draw_text(image, 8, 8, "MMMM", {0.5f, 3});
  float colors = 0, depth = 0;
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 10; ++x) {
      colors += image.at(x, y, 0);
      depth += image.at(x, y, 3);
    }
  EXPECT_GT(colors, 0.0f);
  EXPECT_EQ(depth, 0.0f);
  EXPECT_EQ(text_width(""), 0);
  EXPECT_EQ(text_width("ab", 2), 2 * text_width("ab"));
  EXPECT_EQ(text_width("\xc3\xa9"), find_glyph('\x01').width) << "one box for one character";
}

}  // namespace
}  // namespace polymorph
