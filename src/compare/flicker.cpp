#include "compare/flicker.h"

#include <algorithm>
#include <cmath>

#include "image/srgb.h"

namespace polymorph {

std::optional<Flicker> flicker_between(const Image& frame, const Image& next) {
  if (frame.width != next.width || frame.height != next.height) return std::nullopt;
  int colors[2][3];
  for (int c = 0; c < 3; ++c) {
    const char* const name = c == 0 ? "R" : c == 1 ? "G" : "B";
    colors[0][c] = frame.find_channel(name);
    colors[1][c] = next.find_channel(name);
    if (colors[0][c] < 0 || colors[1][c] < 0) return std::nullopt;
  }
  const int ids[] = {frame.find_channel("id"), next.find_channel("id")};
  const int motions[] = {frame.find_channel("motion.X"), frame.find_channel("motion.Y")};
  Flicker flicker;
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x) {
      if (ids[0] >= 0 && ids[1] >= 0 && frame.at(x, y, ids[0]) != next.at(x, y, ids[1])) continue;
      if ((motions[0] >= 0 && frame.at(x, y, motions[0]) != 0) ||
          (motions[1] >= 0 && frame.at(x, y, motions[1]) != 0))
        continue;
      double sum = 0;
      for (int c = 0; c < 3; ++c) {
        const auto shown = [](float v) {
          return static_cast<double>(linear_to_srgb(std::clamp(v, 0.0f, 1.0f)));
        };
        sum += std::fabs(shown(frame.at(x, y, colors[0][c])) - shown(next.at(x, y, colors[1][c])));
      }
      if (!std::isfinite(sum)) continue;
      flicker.mean += sum / 3;
      ++flicker.pixels;
    }
  if (flicker.pixels == 0) return std::nullopt;
  flicker.mean /= static_cast<double>(flicker.pixels);
  return flicker;
}

}  // namespace polymorph
