// Moves of a carried mesh's points: onto a surface and along it, so that no triangle is inverted.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/carry/carry_target.h"
#include "mesh/carry/deviation.h"
#include "mesh/fans.h"

namespace polymorph {

/// A mesh whose points move.
struct MovedMesh {
  std::vector<Vec3>& points;
  std::span<const Triangle> triangles;
  const Fans& fans;
};

/// What a surface has nearest to points.
struct Footprint {
  std::vector<Vec3> points, normals;
};
/// `near`, here and below: of each point a triangle of the surface that may be near, or none.
Footprint footprint(std::span<const Vec3> points, const CarryTarget& target,
                    std::vector<std::uint32_t>& near);

/// 1: equilateral and parallel to the surface; 0: without area or upright on it; negative:
/// inverted.
float shape_of(Vec3 a, Vec3 b, Vec3 c, Vec3 normal);

/// How far a point goes towards the middle of its fan in one move.
inline constexpr float kRelax = 0.5f;

/// One sweep over all points: each goes onto the surface and, by `relax`, towards the middle of its
/// fan, as far as no triangle around it gets worse than it may be.
void sweep(const MovedMesh& mesh, const CarryTarget& target, float relax,
           std::vector<std::uint32_t>& near);

/// Moves points around `seeds` (triangles), and around triangles that are inverted, nearly so or
/// further than `far` from the surface, until none is.
void repair(const MovedMesh& mesh, const CarryTarget& target, float far,
            std::span<const std::uint32_t> near, std::span<const std::uint32_t> seeds = {});

/// Draws points towards what the mesh misses: corners and ridges, to which no projection leads.
void reach(const MovedMesh& mesh, const CarryTarget& target, std::vector<Deviation::Listed> misses,
           std::vector<std::uint32_t>& near);

}  // namespace polymorph
