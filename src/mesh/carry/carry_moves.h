// Vertex moves of a carried mesh: onto a surface and along it, without inverting triangles.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/carry/carry_target.h"
#include "mesh/carry/deviation.h"
#include "mesh/fans.h"

namespace polymorph {

/// A mesh whose points are moved in place.
struct MovedMesh {
  std::vector<Vec3>& points;
  std::span<const Triangle> triangles;
  const Fans& fans;
  /// Called by repair() between its steps, unless it is null; repair() ends once it returns false.
  const std::function<bool()>* keep_going = nullptr;
};

/// Closest points on the surface, with its smooth normals there.
struct SurfaceProjection {
  std::vector<Vec3> points, normals;
};
/// Projects points onto the surface. `near`, here and below: per point, a guess of the surface's
/// nearest triangle; may be empty. If it is not const, it is set to the triangles found.
SurfaceProjection project_onto_surface(std::span<const Vec3> points, const CarryTarget& target,
                                       std::vector<std::uint32_t>& near);

/// Quality of a triangle: 1 if equilateral and parallel to the surface, 0 if it has no area or is
/// perpendicular to the surface, negative if inverted.
float triangle_quality(Vec3 a, Vec3 b, Vec3 c, Vec3 normal);

/// Fraction of the distance to its fan's centroid that a point moves per step.
inline constexpr float kRelax = 0.5f;

/// Moves each point onto the surface and, by the fraction `relax`, towards the centroid of its fan.
/// A move is shortened or left out where it would lower the minimum quality of the triangles
/// around the point and make it less than 0.1.
void move_onto_surface(const MovedMesh& mesh, const CarryTarget& target, float relax,
                       std::vector<std::uint32_t>& near);

/// Moves points around `seeds` (triangles), and around triangles that are inverted, nearly inverted
/// or further than `max_distance` from the surface, until there are no such triangles (with seeds,
/// for 6 rounds at least). Gives up after 30 rounds, or after 6 rounds in a row without progress.
void repair(const MovedMesh& mesh, const CarryTarget& target, float max_distance,
            std::span<const std::uint32_t> near, std::span<const std::uint32_t> seeds = {});

/// Moves points within `rings` rings of `seeds` (triangles) to the mean of their neighbours and
/// onto the surface, 20 times, which makes small triangles larger and unfolds them. Details that
/// only these points show may be lost: measure the result.
void spread_points(const MovedMesh& mesh, const CarryTarget& target,
                   std::span<const std::uint32_t> seeds, std::span<const std::uint32_t> near,
                   int rings);

/// Moves points towards `misses` (CarryMeasure::misses): corners and ridges of the surface, which
/// projection never reaches. Misses beyond `large_miss` also draw points into creases
/// and to the rims of thin sheets.
void pull_towards_misses(const MovedMesh& mesh, const CarryTarget& target,
                         std::vector<Deviation::Listed> misses, float large_miss,
                         std::vector<std::uint32_t>& near);

}  // namespace polymorph
