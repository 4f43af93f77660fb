// Maximum length of a film.
#pragma once

namespace polymorph {

/// Maximum number of frames of a film, and of meshes of a sequence.
inline constexpr int kMaxFrames = 100'000;

}  // namespace polymorph
