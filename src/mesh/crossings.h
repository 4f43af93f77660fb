// Crossings of a mesh's triangles by short segments along the axes, as differences of winding
// numbers.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/box.h"
#include "mesh/closest_tree.h"

namespace polymorph {

/// Lists the triangles whose bounds touch the box. The hierarchy must not be split.
void list_triangles(const TriangleBvhView& bvh, const Box& box,
                    std::vector<TriangleBvh::Corners>& triangles);

/// Counts how often the segment from `from` to `from` + `length` along an axis (0, 1 or 2) goes
/// through one of the triangles from its front, less how often from its back: the difference of the
/// winding numbers at its ends, if the mesh is closed. Returns nothing if the segment comes so near
/// to an edge, or an end to a triangle, that rounding could decide.
std::optional<int> count_entries(std::span<const TriangleBvh::Corners> triangles, Vec3 from,
                                 int axis, double length);

}  // namespace polymorph
