// Velocities in PLY files: properties vx, vy and vz of the vertices.
#pragma once

#include <filesystem>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// A vertex in the file's coordinates, and its velocity in the same units per second.
struct PointVelocity {
  Vec3 point, velocity;
};

/// Loads all vertices in the file's order. The list is empty if the file is no PLY, has no such
/// properties, or is broken (load_model() reports that).
std::vector<PointVelocity> load_ply_velocities(const std::filesystem::path& path);

}  // namespace polymorph
