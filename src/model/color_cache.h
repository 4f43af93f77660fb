// Colour volumes of models, from the disk cache or computed.
#pragma once

#include <filesystem>
#include <span>

#include "model/color_volume.h"

namespace polymorph {

/// Increment when make_color_volume() changes its results: older cache files are then ignored. A
/// test pins the digest.
inline constexpr std::uint32_t kColorVolumeVersion = 1;

/// Returns make_color_volume(model, face_classes). Reads and writes a cache file in `folder`, of
/// about 1 MB, unless that is empty.
ColorVolume load_or_make_color_volume(const Model& model, std::span<const FaceClass> face_classes,
                                      const std::filesystem::path& folder);

}  // namespace polymorph
