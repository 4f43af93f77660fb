// Surfaces as PLY files.
#pragma once

#include <span>
#include <string>

#include "interchange/surface_frame.h"

namespace polymorph {

/// Encodes all actors' surfaces, one after the other, as a binary little-endian PLY. A vertex has x
/// y z; nx ny nz, red green blue (sRGB, 0..255) and an int `label`, each if all surfaces have them;
/// s t (v up) and vx vy vz (units per second), each if any surface has them (0 on the others).
/// Comments give the labels' names: "comment label 0 beak". Points are not split at the seams of a
/// texture: s and t of a point on a seam are the coordinates on one side, while the list `texcoord`
/// of each face has the coordinates of its own corners.
std::string encode_ply(std::span<const SurfaceFrame> frames, const SurfaceSequence& sequence);

}  // namespace polymorph
