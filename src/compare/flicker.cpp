#include "compare/flicker.h"

#include <algorithm>
#include <cmath>

#include "image/rgb_channels.h"
#include "image/srgb.h"

namespace polymorph {

std::optional<Flicker> flicker_between(const Image& frame, const Image& next) {
  if (frame.width != next.width || frame.height != next.height) return std::nullopt;
  if (!has_rgb(frame) || !has_rgb(next)) return std::nullopt;
  // Channels of `frame`, then of `next`; motion in x, then in y, of `frame` alone.
  const std::array<int, 3> color_channels[] = {find_rgb(frame), find_rgb(next)};
  const int id_channels[] = {frame.find_channel("id"), next.find_channel("id")};
  const int motion_channels[] = {frame.find_channel("motion.X"), frame.find_channel("motion.Y")};
  Flicker flicker;  // `mean` is the sum until the end
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x) {
      if (id_channels[0] >= 0 && id_channels[1] >= 0 &&
          frame.at(x, y, id_channels[0]) != next.at(x, y, id_channels[1]))
        continue;
      if ((motion_channels[0] >= 0 && frame.at(x, y, motion_channels[0]) != 0) ||
          (motion_channels[1] >= 0 && frame.at(x, y, motion_channels[1]) != 0))
        continue;
      double sum = 0;
      for (int c = 0; c < 3; ++c) {
        const auto to_srgb = [](float v) {
          return static_cast<double>(linear_to_srgb(std::clamp(v, 0.0f, 1.0f)));
        };
        sum += std::fabs(to_srgb(frame.at(x, y, color_channels[0][c])) -
                         to_srgb(next.at(x, y, color_channels[1][c])));
      }
      if (!std::isfinite(sum)) continue;  // a NaN in a colour
      flicker.mean += sum / 3;
      ++flicker.pixels;
    }
  if (flicker.pixels == 0) return std::nullopt;
  flicker.mean /= static_cast<double>(flicker.pixels);
  return flicker;
}

}  // namespace polymorph
