// One-sided Hausdorff distance from a triangle mesh to another, with a bound.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh_query.h"

namespace polymorph {

struct DeviationSettings {
  float negligible = 0;  ///< distances below need not be told apart
  float precision = 0;   ///< how much too large others may be
  float listed = 0;      ///< points further off than this are listed
};

/// How far the points of a mesh are from another mesh, not only the corners but any of them.
struct Deviation {
  struct Listed {
    Vec3 point;
    float distance;
    std::uint32_t triangle;  ///< of the other mesh, nearest to the point
  };
  struct OfTriangle {
    /// No point is further off; where it is more than negligible one comes within the precision.
    float distance = 0;
    Vec3 place;  ///< the furthest point that was tried
    std::vector<Listed> listed;
    std::vector<std::uint32_t> witnesses;  ///< triangles of the other mesh that bound the distance
  };
  std::vector<OfTriangle> triangles;
  std::vector<std::uint32_t> nearest;  ///< of each point: the other mesh's triangle nearest to it
};

/// What an earlier deviation says of meshes of which some triangles are the same still.
struct KnownDeviation {
  static constexpr std::uint32_t kNew = 0xffffffffu;
  const Deviation& last;
  std::vector<std::uint32_t> own;    ///< of each triangle: its number then, or kNew
  std::vector<std::uint32_t> other;  ///< of each of the other mesh's then: its number now, or kNew
  /// Whether all of the other mesh is as it was: then what is far is known as well.
  bool is_other_same = false;
};

/// Triangles are divided until their corners bound their distance (after Guthe, Borodin and Klein,
/// Fast and accurate Hausdorff distance calculation between meshes, 2005). `hints` of the points:
/// see MeshQuery.
Deviation deviation(std::span<const Vec3> points, std::span<const Triangle> triangles,
                    const MeshQuery& other, const DeviationSettings& settings,
                    std::vector<std::uint32_t> hints = {}, const KnownDeviation* known = nullptr);

}  // namespace polymorph
