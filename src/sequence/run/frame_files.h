// Files of a scene's frames: which of EXR and PNG are written, under which names.
#pragma once

#include <string>

#include "image/image_io.h"
#include "scene/scene.h"
#include "sequence/run/frames.h"

namespace polymorph {

/// `output` (-o) or, where that is empty, the scene's; `is_sequence` frames get a place for their
/// number. Errors (kUsage): an extension that is neither .exr nor .png, too few digits for the
/// scene.
Result<FrameFiles> frame_files(const Scene& scene, const std::string& output, bool png,
                               bool is_sequence);

/// Settings of the scene's EXR files.
ExrSettings exr_settings(const Scene& scene);

/// Settings of a frame's PNG, after its scene.
PngSettings png_settings(const Scene& scene, int frame);

}  // namespace polymorph
