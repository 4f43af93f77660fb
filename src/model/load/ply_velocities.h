// Velocities that a PLY file stores beside its vertices, as properties vx, vy and vz.
#pragma once

#include <filesystem>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

/// A vertex in the file's coordinates, and its velocity in these per second.
struct PointVelocity {
  Vec3 point, velocity;
};

/// All vertices in the file's order. Nothing where the file is no PLY, has no such properties, or
/// is broken, which load_model() reports.
std::vector<PointVelocity> load_ply_velocities(const std::filesystem::path& path);

}  // namespace polymorph
