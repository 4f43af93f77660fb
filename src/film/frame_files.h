// Files of a scene's frames: their names, and the settings with which EXR and PNG files are
// written.
#pragma once

#include <string>

#include "base/frames.h"
#include "image/image_io.h"
#include "scene/scene.h"

namespace polymorph {

/// Returns the names of the frames' files according to `output` (the option -o) or, if that is
/// empty, to the scene's output.file. `png`: write PNG files besides EXR files; `is_sequence`: file
/// names need a frame number. Errors: kUsage for an extension that is neither .exr nor .png, or for
/// a number with too few digits for the scene's frames.
Result<FrameFiles> frame_files(const Scene& scene, const std::string& output, bool png,
                               bool is_sequence);

/// Returns the settings of the scene's EXR files.
ExrSettings exr_settings(const Scene& scene);

/// Returns the settings of a frame's PNG file.
PngSettings png_settings(const Scene& scene, int frame);

}  // namespace polymorph
