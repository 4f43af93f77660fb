// MP4 movies, encoded by ffmpeg where it is installed.
#pragma once

#include <filesystem>
#include <span>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// Finds ffmpeg in the search path; empty if it is not installed.
std::filesystem::path find_ffmpeg();

/// Writes an MP4 (H.264, 4:2:0, Rec. 709) of sRGB-encoded R, G, B. All frames must have one size.
/// Odd sizes, which 4:2:0 cannot represent, lose their last column or row. The file is written
/// under a temporary name and renamed. Errors: kInput for no frames or unequal sizes; kResource
/// without ffmpeg; kOutput with ffmpeg's message if it fails.
Status write_mp4(const std::filesystem::path& path, std::span<const Image> frames,
                 float frames_per_second);

}  // namespace polymorph
