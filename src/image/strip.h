// Contact sheets: frames side by side, each with its label.
#pragma once

#include <span>
#include <string>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

struct StripSettings {
  int columns = 4;
  int gap = 6;         ///< pixels between cells and around the sheet
  int cell_width = 0;  ///< frames are scaled (area filter) to this width; 0: not scaled
  bool labels = true;
  float background = 0.02f;  ///< linear grey
};

/// Makes one sheet of all frames, which must have equal sizes, row by row. Labels are centred below
/// the frames and cut to their width. The sheet has R, G and B only; transparent pixels show the
/// background. `labels` is empty or has one entry per frame. Errors: kInput for unequal sizes, no
/// frames, missing colour channels.
Result<Image> make_strip(std::span<const Image> frames, std::span<const std::string> labels,
                         const StripSettings& settings = {});

struct TextStyle {
  float grey = 1;  ///< linear
  int scale = 1;   ///< pixels per dot of the font
};
/// Draws ASCII text in a bitmap font (image/font.h) onto R, G and B; (x, y) is the top left corner
/// of the text. Clipped at the image's edges; characters outside ASCII are drawn as hollow boxes.
void draw_text(Image& image, int x, int y, const std::string& text, TextStyle style);
/// Width and height of drawn text in pixels; `scale` is as in TextStyle.
int text_width(const std::string& text, int scale = 1);
int text_height(int scale = 1);

/// Box-filtered resize to `width` x `height` (all channels: the mean over each new pixel's area).
Image resize_image(const Image& image, int width, int height);

}  // namespace polymorph
