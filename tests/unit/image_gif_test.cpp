#include <gif_lib.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/parallel.h"
#include "image/blue_noise.h"
#include "image/image_io.h"
#include "image/palette.h"
#include "testing/image.h"

namespace polymorph {
namespace {

struct Source {
  const std::string& bytes;
  std::size_t at = 0;
};

int take(GifFileType* gif, GifByteType* to, int size) {
  auto& source = *static_cast<Source*>(gif->UserData);
  const auto n = std::min(static_cast<std::size_t>(size), source.bytes.size() - source.at);
  std::memcpy(to, source.bytes.data() + source.at, n);
  source.at += n;
  return static_cast<int>(n);
}

struct Decoded {
  int width = 0, height = 0, colors = 0;
  std::vector<int> delays;
  std::vector<std::vector<Rgb8>> frames;  ///< as shown: each drawn over the one before
};

/// What a viewer would show.
Decoded decode(const std::string& bytes) {
  Decoded result;
  Source source{bytes};
  int error = 0;
  GifFileType* gif = DGifOpen(&source, take, &error);
  EXPECT_NE(gif, nullptr) << GifErrorString(error);
  if (!gif) return result;
  EXPECT_EQ(DGifSlurp(gif), GIF_OK);
  result.width = gif->SWidth;
  result.height = gif->SHeight;
  result.colors = gif->SColorMap ? gif->SColorMap->ColorCount : 0;
  std::vector<Rgb8> screen(static_cast<std::size_t>(gif->SWidth * gif->SHeight));
  for (int i = 0; i < gif->ImageCount; ++i) {
    GraphicsControlBlock control{};
    EXPECT_EQ(DGifSavedExtensionToGCB(gif, i, &control), GIF_OK);
    result.delays.push_back(control.DelayTime);
    const SavedImage& image = gif->SavedImages[i];
    EXPECT_EQ(image.ImageDesc.ColorMap, nullptr);
    for (int y = 0; y < image.ImageDesc.Height; ++y)
      for (int x = 0; x < image.ImageDesc.Width; ++x) {
        const int index = image.RasterBits[y * image.ImageDesc.Width + x];
        if (index == control.TransparentColor) continue;
        const GifColorType& color = gif->SColorMap->Colors[index];
        screen[static_cast<std::size_t>((y + image.ImageDesc.Top) * gif->SWidth + x +
                                        image.ImageDesc.Left)] = {color.Red, color.Green,
                                                                  color.Blue};
      }
    result.frames.push_back(screen);
  }
  DGifCloseFile(gif, &error);
  return result;
}

/// A ramp with a coloured block that moves from frame to frame.
std::vector<Image> moving_block(int count) {
  std::vector<Image> frames;
  for (int f = 0; f < count; ++f) {
    Image frame = make_image(96, 64, {"R", "G", "B", "A"});
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 96; ++x) {
        const bool block = x >= 4 + 8 * f && x < 24 + 8 * f && y >= 20 && y < 40;
        const float grey = static_cast<float>(x + y) / 160.0f;
        frame.at(x, y, 0) = block ? 0.8f : grey;
        frame.at(x, y, 1) = block ? 0.1f : grey;
        frame.at(x, y, 2) = block ? 0.05f : grey;
        frame.at(x, y, 3) = 1;
      }
    frames.push_back(std::move(frame));
  }
  return frames;
}

Rgb8 codes_of(const Image& image, int x, int y) {
  const SrgbQuantizer& quantize = SrgbQuantizer::instance();
  return {quantize(image.at(x, y, 0)), quantize(image.at(x, y, 1)), quantize(image.at(x, y, 2))};
}

TEST(EncodeGif, ReadsBackWithSizeFramesTimesAndColours) {
  const std::vector<Image> frames = moving_block(6);
  const auto bytes = encode_gif(frames, 24);
  ASSERT_TRUE(bytes) << bytes.error().message;
  EXPECT_EQ(bytes->substr(0, 6), "GIF89a");
  EXPECT_NE(bytes->find("NETSCAPE2.0"), std::string::npos);
  const Decoded back = decode(*bytes);
  EXPECT_EQ(back.width, 96);
  EXPECT_EQ(back.height, 64);
  EXPECT_EQ(back.colors, 256);
  ASSERT_EQ(back.frames.size(), 6u);
  // 24 frames per second in hundredths: 25 in all after 6 frames, not 6 times 4.
  EXPECT_EQ(back.delays, (std::vector<int>{4, 4, 5, 4, 4, 4}));
  for (std::size_t f = 0; f < 6; ++f)
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 96; ++x) {
        const Rgb8 wanted = codes_of(frames[f], x, y),
                   shown = back.frames[f][static_cast<std::size_t>(y * 96 + x)];
        for (std::size_t c = 0; c < 3; ++c)
          ASSERT_NEAR(wanted[c], shown[c], 8) << f << ": " << x << ", " << y;
      }
}

TEST(EncodeGif, DitherKeepsTheMeanOfAreas) {
  // 600 colours, so that most lie between entries of the palette.
  Image frame = make_image(128, 128, {"R", "G", "B"});
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x) {
      frame.at(x, y, 0) = srgb_to_linear(static_cast<float>(x) / 127.0f);
      frame.at(x, y, 1) = srgb_to_linear(static_cast<float>(y) / 127.0f);
      frame.at(x, y, 2) = srgb_to_linear(0.5f);
    }
  const Decoded back = decode(*encode_gif(std::vector<Image>{frame}, 10));
  for (int by = 0; by < 128; by += 16)
    for (int bx = 0; bx < 128; bx += 16)
      for (std::size_t c = 0; c < 3; ++c) {
        double wanted = 0, shown = 0;
        for (int y = by; y < by + 16; ++y)
          for (int x = bx; x < bx + 16; ++x) {
            wanted += codes_of(frame, x, y)[c];
            shown += back.frames[0][static_cast<std::size_t>(y * 128 + x)][c];
          }
        EXPECT_NEAR(wanted / 256, shown / 256, 4) << bx << ", " << by;
      }
}

TEST(EncodeGif, StillPartsStandStill) {
  std::vector<Image> frames = moving_block(5);
  // Noise below the limit must not move a pixel.
  for (std::size_t f = 0; f < frames.size(); ++f)
    for (std::size_t i = 0; i < frames[f].pixels.size(); ++i)
      frames[f].pixels[i] *= 1.0f + 0.004f * (random_float(3, f, i) - 0.5f);
  const Decoded back = decode(*encode_gif(frames, 12));
  for (std::size_t f = 1; f < back.frames.size(); ++f)
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 96; ++x)
        ASSERT_EQ(back.frames[f][static_cast<std::size_t>(y * 96 + x)],
                  back.frames[0][static_cast<std::size_t>(y * 96 + x)]);
  // And frames that only repeat cost next to nothing.
  const std::vector<Image> still(20, frames[0]);
  EXPECT_LT(encode_gif(still, 12)->size(),
            encode_gif(std::span(still).first(1), 12)->size() + 20 * 40);
}

TEST(EncodeGif, IsTheSameForAnyThreadCount) {
  const std::vector<Image> frames = moving_block(3);
  set_thread_count(1);
  const std::string one = *encode_gif(frames, 12);
  set_thread_count(2);
  const std::string two = *encode_gif(frames, 12);
  set_thread_count(0);
  EXPECT_TRUE(one == two);
}

TEST(EncodeGif, RefusesWhatDoesNotFitTogether) {
  EXPECT_FALSE(encode_gif({}, 12));
  const std::vector<Image> sizes{make_image(4, 4, {"R", "G", "B"}),
                                 make_image(5, 4, {"R", "G", "B"})};
  const auto mixed = encode_gif(sizes, 12);
  ASSERT_FALSE(mixed);
  EXPECT_NE(mixed.error().message.find("5 x 4"), std::string::npos);
  EXPECT_FALSE(encode_gif(std::vector<Image>{make_image(4, 4, {"Z"})}, 12));
}

TEST(Palette, FewColoursAreKeptExactly) {
  const std::vector<Rgb8> colors{{0, 0, 0}, {10, 200, 30}, {255, 0, 8}, {255, 255, 255}};
  ColorHistogram histogram;
  histogram.add(std::vector<Rgb8>(1000, colors[0]));
  histogram.add(colors);
  EXPECT_EQ(choose_palette(histogram, 255), colors);
}

TEST(BlueNoise, RanksEachPixelOnceAndSpreadsThemEvenly) {
  const std::vector<std::uint16_t>& ranks = blue_noise_ranks();
  std::vector<std::uint16_t> sorted = ranks;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
  // The lowest eighth: white noise would put some pairs side by side, this must not.
  const int size = kBlueNoiseSize;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      if (ranks[static_cast<std::size_t>(y * size + x)] >= size * size / 8) continue;
      EXPECT_GE(ranks[static_cast<std::size_t>(y * size + (x + 1) % size)], size * size / 8);
      EXPECT_GE(ranks[static_cast<std::size_t>((y + 1) % size * size + x)], size * size / 8);
    }
}

}  // namespace
}  // namespace polymorph
