// Mesh coarsening by collapses of short edges, for the mesh that is carried.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

struct CoarsenSettings {
  float edge = 0;       ///< edges shorter than this are collapsed; none grows beyond 1.5 times it
  float deviation = 0;  ///< maximum distance of a new point from the planes of its old triangles
  /// If not null, only edges of `chosen` triangles are collapsed, once, and `accepts` decides in
  /// the first shape, in place of deviation and turn: a triangle may only be left with corners that
  /// it rejects if it rejected the old ones.
  const std::function<bool(Vec3, Vec3, Vec3)>* accepts = nullptr;
  std::span<const std::uint32_t> chosen = {};
};

/// A closed mesh with the positions of its points in one or several shapes, which share the
/// triangles.
struct CoarsenedMesh {
  std::vector<std::vector<Vec3>*> shapes;  ///< CoarsenSettings::edge refers to the first one
  std::vector<Triangle>& triangles;
  /// Deviation per point that earlier collapses have caused, which counts towards the maximum; null
  /// if none does.
  std::vector<float>* deviations = nullptr;
};

/// Collapses edges to their midpoints in all shapes, short ones first (after Hoppe, DeRose,
/// Duchamp, McDonald and Stuetzle, Mesh optimization, 1993). Collapses that would change the
/// topology, turn a triangle by more than 32 degrees or exceed the deviation in any shape are left
/// out. Returns the new index of each former point; the two ends of a collapsed edge share one.
std::vector<std::uint32_t> coarsen(const CoarsenedMesh& mesh, const CoarsenSettings& settings);

}  // namespace polymorph
