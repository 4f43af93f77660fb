#include "image/strip.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "image/font.h"
#include "image/rgb_channels.h"

namespace polymorph {
namespace {

// Linear 0.55 is sRGB 0.77: legible on a dark sheet but not brighter than the frames.
constexpr float kLabelOnDark = 0.55f;
constexpr float kLabelOnLight = 0.03f;

/// Tests for continuation bytes of UTF-8, which add no character.
bool is_continuation(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

/// A square of pixels; it may reach beyond the image.
struct Square {
  int left, top, size;
};
void fill_square(Image& image, Square square, const std::array<int, 3>& channels, float grey) {
  const auto [left, top, size] = square;
  for (int y = std::max(top, 0); y < std::min(top + size, image.height); ++y)
    for (int x = std::max(left, 0); x < std::min(left + size, image.width); ++x)
      for (const int channel : channels)
        if (channel >= 0) image.at(x, y, channel) = grey;
}

/// Draws `frame` over the background at (left, top).
void draw_frame(const Image& frame, int left, int top, float background, Image& sheet) {
  const std::array<int, 3> colors = find_rgb(frame);
  const int alpha = frame.find_channel("A");
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x) {
      const float visible_background = alpha >= 0 ? background * (1 - frame.at(x, y, alpha)) : 0.0f;
      for (int c = 0; c < 3; ++c)
        sheet.at(left + x, top + y, c) = frame.at(x, y, colors[c]) + visible_background;
    }
}

/// Scale of the labels: 2 if they all fit and the cells are at least 200 pixels wide, else 1.
int choose_label_scale(std::span<const std::string> labels, int cell_width) {
  for (const std::string& label : labels)
    if (text_width(label, 2) > cell_width) return 1;
  return cell_width >= 200 ? 2 : 1;
}

/// Truncates `text` to a width in pixels.
std::string fit_text(std::string text, int width, int scale) {
  while (!text.empty() && text_width(text, scale) > width) text.pop_back();
  return text;
}

}  // namespace

int text_width(const std::string& text, int scale) {
  int width = 0;
  for (const char c : text)
    if (!is_continuation(c)) width += find_glyph(c).width + kFontGap;
  return width > 0 ? (width - kFontGap) * scale : 0;
}

int text_height(int scale) { return kFontHeight * scale; }

void draw_text(Image& image, int x, int y, const std::string& text, TextStyle style) {
  const auto [grey, scale] = style;
  const std::array<int, 3> channels = find_rgb(image);
  for (const char c : text) {
    if (is_continuation(c)) continue;
    const Glyph& glyph = find_glyph(c);
    for (int row = 0; row < kFontHeight; ++row)
      for (int column = 0; column < glyph.width; ++column)
        if (glyph.rows[static_cast<std::size_t>(row)] >> column & 1)
          fill_square(image, {x + column * scale, y + row * scale, scale}, channels, grey);
    x += (glyph.width + kFontGap) * scale;
  }
}

Result<Image> make_strip(std::span<const Image> frames, std::span<const std::string> labels,
                         const StripSettings& settings) {
  PM_CHECK(settings.columns > 0 && settings.gap >= 0 && settings.cell_width >= 0);
  PM_TRY_STATUS(check_frames(frames, "contact sheet"));
  if (!labels.empty() && labels.size() != frames.size())
    return make_error(ErrorCode::kInput,
                      "{} labels for {} frames of the contact sheet - give one per frame",
                      labels.size(), frames.size());
  // Find the sizes of the cells, of the labels and of the sheet, in pixels.
  const int cell_width = settings.cell_width > 0 ? settings.cell_width : frames[0].width;
  const int cell_height = std::max(
      1, static_cast<int>((std::int64_t{frames[0].height} * cell_width + frames[0].width / 2) /
                          frames[0].width));
  const int count = static_cast<int>(frames.size());
  const int columns = std::min(settings.columns, count), rows = (count + columns - 1) / columns;
  const bool labelled = settings.labels && !labels.empty();
  const int scale = choose_label_scale(labels, cell_width);
  const int label_gap = 4 * scale;  // between a frame and its label
  const int row_height =
      cell_height + settings.gap + (labelled ? label_gap + text_height(scale) : 0);
  Image sheet = make_image(columns * (cell_width + settings.gap) + settings.gap,
                           rows * row_height + settings.gap, {"R", "G", "B"});
  std::fill(sheet.pixels.begin(), sheet.pixels.end(), settings.background);
  // Draw the frames and their labels.
  for (int i = 0; i < count; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const int left = settings.gap + i % columns * (cell_width + settings.gap);
    const int top = settings.gap + i / columns * row_height;
    draw_frame(resize_image(frames[n], cell_width, cell_height), left, top, settings.background,
               sheet);
    if (!labelled) continue;
    const std::string text = fit_text(labels[n], cell_width, scale);
    draw_text(sheet, left + (cell_width - text_width(text, scale)) / 2,
              top + cell_height + label_gap, text,
              {settings.background < 0.2f ? kLabelOnDark : kLabelOnLight, scale});
  }
  return sheet;
}

}  // namespace polymorph
