// Surfaces as PLY files.
#pragma once

#include <span>
#include <string>

#include "interchange/surface_frame.h"

namespace polymorph {

/// Binary little-endian PLY of all actors' surfaces, one after the other. A vertex has x y z and,
/// of what all the frames have, nx ny nz, red green blue (sRGB, 0..255), s t (v up), vx vy vz
/// (units a second) and an int `label`, whose names stand in comments: "comment label 0 beak".
/// Points are not split at the seams of a texture: there s and t are those of one side, and the
/// faces' list `texcoord` has both.
std::string encode_ply(std::span<const SurfaceFrame> frames, const SurfaceSequence& sequence);

}  // namespace polymorph
