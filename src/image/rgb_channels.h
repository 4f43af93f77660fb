// Channels R, G and B of images.
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// Finds the indices of R, G and B; -1 for a missing channel.
inline std::array<int, 3> find_rgb(const Image& image) {
  return {image.find_channel("R"), image.find_channel("G"), image.find_channel("B")};
}
inline bool has_rgb(const Image& image) { return std::ranges::min(find_rgb(image)) >= 0; }

/// Checks that there are frames, of one size and with R, G and B. Errors: kInput; `output` names
/// what is made of the frames, for the message ("GIF").
inline Status check_frames(std::span<const Image> frames, const char* output) {
  if (frames.empty()) return make_error(ErrorCode::kInput, "a {} needs at least one frame", output);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Image& frame = frames[i];
    if (frame.width != frames[0].width || frame.height != frames[0].height)
      return make_error(ErrorCode::kInput,
                        "frame {} of the {} is {} x {}, the first is {} x {} - give frames of one "
                        "size",
                        i + 1, output, frame.width, frame.height, frames[0].width,
                        frames[0].height);
    if (!has_rgb(frame))
      return make_error(ErrorCode::kInput, "frame {} of the {} has no R, G and B channels", i + 1,
                        output);
  }
  return Ok{};
}

}  // namespace polymorph
