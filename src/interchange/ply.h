// Surfaces as PLY files.
#pragma once

#include <span>
#include <string>

#include "interchange/surface_frame.h"

namespace polymorph {

/// Encodes all actors' surfaces, one after the other, as a binary little-endian PLY. A vertex has x
/// y z and, if all frames have them, nx ny nz, red green blue (sRGB, 0..255), s t (v up), vx vy vz
/// (units per second) and an int `label`, whose names are given in comments: "comment label 0
/// beak". Points are not split at the seams of a texture: s and t of a point on a seam are the
/// coordinates on one side, while the list `texcoord` of each face has the coordinates of its own
/// corners.
std::string encode_ply(std::span<const SurfaceFrame> frames, const SurfaceSequence& sequence);

}  // namespace polymorph
