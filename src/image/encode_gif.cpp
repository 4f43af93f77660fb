#include <gif_lib.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/parallel.h"
#include "image/blue_noise.h"
#include "image/image_io.h"
#include "image/palette.h"
#include "image/rgb_channels.h"

namespace polymorph {
namespace {

/// A pixel counts as unchanged if no channel differs by more than this, in 8-bit codes.
constexpr int kMaxUnchanged = 3;

/// A frame of the GIF, which may be smaller than the screen.
struct Frame {
  int left = 0, top = 0, width = 0, height = 0;  ///< rectangle that changed
  std::vector<std::uint8_t> indices;             ///< palette indices of its pixels, row by row
};

/// Encodes the colours of an image by the sRGB curve, with 8 bits.
std::vector<Rgb8> encode_colors(const Image& image) {
  const SrgbQuantizer& quantize = SrgbQuantizer::instance();
  const std::array<int, 3> channels = find_rgb(image);
  std::vector<Rgb8> codes(static_cast<std::size_t>(image.width) *
                          static_cast<std::size_t>(image.height));
  parallel_ranges(
      static_cast<std::int64_t>(codes.size()), /*grain=*/1 << 14,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          for (std::size_t c = 0; c < 3; ++c)
            codes[i][c] = quantize(
                image.pixels[i * image.channel_count() + static_cast<std::size_t>(channels[c])]);
      });
  return codes;
}

bool differs(Rgb8 a, Rgb8 b) {
  return std::abs(a[0] - b[0]) > kMaxUnchanged || std::abs(a[1] - b[1]) > kMaxUnchanged ||
         std::abs(a[2] - b[2]) > kMaxUnchanged;
}

/// A viewer's screen while it plays the GIF. `colors` holds the colour of each pixel before
/// dithering, from the frame that drew the pixel last; `indices` holds its palette index.
struct Screen {
  int width, height;
  std::uint8_t transparent;  ///< palette index
  std::vector<Rgb8> colors;
  std::vector<std::uint8_t> indices;
};

/// Draws the bounding box of the changed pixels as a frame, in which unchanged pixels are
/// transparent. Updates the screen.
Frame draw_changes(const std::vector<Rgb8>& colors, const PaletteMap& map, bool is_first,
                   Screen& screen) {
  // Dither the changed pixels with thresholds of (rank + 0.5) / kLevels.
  const std::vector<std::uint16_t>& ranks = blue_noise_ranks();
  constexpr auto kLevels = static_cast<float>(kBlueNoiseSize * kBlueNoiseSize);
  std::vector<std::uint8_t> indices(colors.size(), screen.transparent);
  parallel_for(
      screen.height,
      [&](std::int64_t y) {
        for (int x = 0; x < screen.width; ++x) {
          const std::size_t i = static_cast<std::size_t>(y * screen.width + x);
          if (!is_first && !differs(colors[i], screen.colors[i])) continue;
          const auto tile =
              static_cast<std::size_t>(y % kBlueNoiseSize * kBlueNoiseSize + x % kBlueNoiseSize);
          const std::uint8_t index =
              map.dither(colors[i], (static_cast<float>(ranks[tile]) + 0.5f) / kLevels);
          screen.colors[i] = colors[i];
          if (!is_first && index == screen.indices[i]) continue;
          screen.indices[i] = indices[i] = index;
        }
      },
      /*grain=*/16);
  // Find the bounding box of the pixels that are not transparent, and copy it.
  int left = screen.width, right = 0, top = screen.height, bottom = 0;
  for (int y = 0; y < screen.height; ++y)
    for (int x = 0; x < screen.width; ++x)
      if (indices[static_cast<std::size_t>(y) * static_cast<std::size_t>(screen.width) +
                  static_cast<std::size_t>(x)] != screen.transparent) {
        left = std::min(left, x);
        right = std::max(right, x + 1);
        top = std::min(top, y);
        bottom = std::max(bottom, y + 1);
      }
  // A frame without changes becomes one transparent pixel, because its duration must be stored.
  if (left >= right) return {0, 0, 1, 1, {screen.transparent}};
  Frame frame{left, top, right - left, bottom - top, /*indices=*/{}};
  for (int y = top; y < bottom; ++y) {
    const auto row = indices.begin() + (static_cast<std::ptrdiff_t>(y) * screen.width);
    frame.indices.insert(frame.indices.end(), row + left, row + right);
  }
  return frame;
}

/// Appends data to the string that giflib's user data points to.
int append(GifFileType* gif, const GifByteType* data, int size) {
  static_cast<std::string*>(gif->UserData)
      ->append(reinterpret_cast<const char*>(data), static_cast<std::size_t>(size));
  return size;
}

/// giflib's encoder. It keeps the first error of giflib; close() returns it.
class GifWriter {
 public:
  /// Begins a GIF, whose bytes are appended to `bytes`.
  GifWriter(std::string& bytes, int width, int height, const std::vector<Rgb8>& palette) {
    gif_ = EGifOpen(&bytes, append, &error_);
    if (!gif_) return;
    EGifSetGifVersion(gif_, /*gif89=*/true);
    GifColorType colors[256] = {};
    for (std::size_t i = 0; i < palette.size(); ++i)
      colors[i] = {palette[i][0], palette[i][1], palette[i][2]};
    const std::unique_ptr<ColorMapObject, void (*)(ColorMapObject*)> map(
        GifMakeMapObject(256, colors), GifFreeMapObject);
    check(map ? EGifPutScreenDesc(gif_, width, height, /*GifColorRes=*/8, /*GifBackGround=*/0,
                                  map.get())
              : GIF_ERROR);
    // Netscape's looping extension: block 1, then the number of loops in two bytes, 0 = for ever.
    const GifByteType forever[3] = {1, 0, 0};
    check(EGifPutExtensionLeader(gif_, APPLICATION_EXT_FUNC_CODE));
    check(EGifPutExtensionBlock(gif_, /*ExtLen=*/11, "NETSCAPE2.0"));
    check(EGifPutExtensionBlock(gif_, /*ExtLen=*/3, forever));
    check(EGifPutExtensionTrailer(gif_));
  }
  ~GifWriter() { (void)close(); }
  GifWriter(const GifWriter&) = delete;
  GifWriter& operator=(const GifWriter&) = delete;

  /// Adds a frame that is shown for `centiseconds`; `transparent` is a palette index.
  void add_frame(Frame& frame, int centiseconds, int transparent) {
    if (!gif_ || error_) return;
    const GraphicsControlBlock control{DISPOSE_DO_NOT, /*UserInputFlag=*/false, centiseconds,
                                       transparent};
    GifByteType block[4];
    EGifGCBToExtension(&control, block);
    check(EGifPutExtension(gif_, GRAPHICS_EXT_FUNC_CODE, 4, block));
    check(EGifPutImageDesc(gif_, frame.left, frame.top, frame.width, frame.height,
                           /*GifInterlace=*/false, /*GifColorMap=*/nullptr));
    for (int y = 0; y < frame.height && !error_; ++y)
      check(EGifPutLine(
          gif_, &frame.indices[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width)],
          frame.width));
  }
  /// Ends the GIF. Errors: kOutput.
  Status close() {
    int error = 0;
    if (gif_ && EGifCloseFile(gif_, &error) == GIF_ERROR && !error_) error_ = error;
    gif_ = nullptr;
    if (error_) {
      const char* reason = GifErrorString(error_);
      return make_error(ErrorCode::kOutput, "cannot encode the GIF: {}",
                        reason ? reason : "out of memory");
    }
    return Ok{};
  }

 private:
  /// Stores the error of a call of giflib that returned `result`, unless an earlier one is stored.
  void check(int result) {
    if (result == GIF_ERROR && !error_)
      error_ = gif_->Error ? gif_->Error : E_GIF_ERR_NOT_ENOUGH_MEM;
  }
  GifFileType* gif_ = nullptr;  ///< null: not open
  int error_ = 0;               ///< code of giflib; 0: no error
};

}  // namespace

Result<std::string> encode_gif(std::span<const Image> frames, float frames_per_second) {
  PM_TRY_STATUS(check_frames(frames, "GIF"));
  if (frames[0].width < 1 || frames[0].height < 1 || frames[0].width > 65535 ||
      frames[0].height > 65535)
    return make_error(ErrorCode::kInput, "a GIF cannot be {} x {} pixels (at most 65535 per side)",
                      frames[0].width, frames[0].height);
  PM_CHECK(frames_per_second > 0);
  // Choose a palette for all frames.
  ColorHistogram histogram;
  for (const Image& frame : frames) histogram.add(encode_colors(frame));
  // One of the 256 entries is left for the transparent colour.
  const std::vector<Rgb8> palette = choose_palette(histogram, 255);
  const PaletteMap map(palette);
  const auto transparent = static_cast<std::uint8_t>(palette.size());
  const std::size_t pixels =
      static_cast<std::size_t>(frames[0].width) * static_cast<std::size_t>(frames[0].height);
  // Encode each frame as the changes of the screen that the frames before it have drawn.
  Screen screen{frames[0].width, frames[0].height, transparent, std::vector<Rgb8>(pixels),
                std::vector<std::uint8_t>(pixels)};
  std::string bytes;
  {
    GifWriter writer(bytes, screen.width, screen.height, palette);
    // Viewers show frames shorter than 2/100 s more slowly.
    const double centiseconds = std::max(100.0 / static_cast<double>(frames_per_second), 2.0);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      Frame frame = draw_changes(encode_colors(frames[i]), map, i == 0, screen);
      const auto start_time = [&](std::size_t n) {  // in 1/100 s
        return std::lround(centiseconds * static_cast<double>(n));
      };
      writer.add_frame(frame, static_cast<int>(start_time(i + 1) - start_time(i)), transparent);
    }
    PM_TRY_STATUS(writer.close());
  }
  return bytes;
}

}  // namespace polymorph
