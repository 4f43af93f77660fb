// The length of a film.
#pragma once

namespace polymorph {

/// Frames that a film may have, and meshes of a sequence.
inline constexpr int kMaxFrames = 100'000;

}  // namespace polymorph
