// What a sequence will cost, from measured frames: time, memory and disk.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.h"
#include "kernels/extract_surface.h"
#include "sequence/prepare.h"

namespace polymorph {

struct FrameEstimate {
  int measured = 0;      ///< frames that it is made from
  double seconds = 0;    ///< a frame: surface, tracing and encoding, with all threads
  double exr_bytes = 0;  ///< a frame as EXR
  double png_bytes = 0;  ///< a frame as PNG
};

/// Renders up to three of the frames, evenly spread, with at most an eighth of the samples (at
/// least one), and scales the time of tracing up. Writes nothing. With image.noise it is the time
/// at the full number of samples, which most pixels do not need. Errors: kResource, kOutput.
Result<FrameEstimate> estimate_frames(const PreparedScene& prepared, SurfaceExtractor& extractor,
                                      const std::string& isa, std::span<const int> frames);

}  // namespace polymorph
