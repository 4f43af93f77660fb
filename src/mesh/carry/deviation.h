// One-sided Hausdorff distance from one triangle mesh to another, with an error bound.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/mesh_query.h"

namespace polymorph {

/// Tolerances of a measurement, in the meshes' units.
struct DeviationSettings {
  float negligible = 0;  ///< smaller distances are only bounded by this
  float precision = 0;   ///< maximum error of larger distances
  float listed = 0;      ///< points beyond this distance are listed
  /// A hinted triangle within this distance of a point counts as its nearest one; at most
  /// `negligible` less `precision`. So does one within that maximum which a walk from it reaches
  /// (MeshQuery::walk_to_closest()).
  float sufficient = 0;
  bool are_witnesses_listed = true;  ///< false: the other mesh stays the same in later measurements
};

/// Distances of all points of a mesh, not only its vertices, from another mesh.
struct Deviation {
  /// A point further than DeviationSettings::listed from the other mesh.
  struct Listed {
    Vec3 point;
    float distance;
    std::uint32_t triangle;  ///< the other mesh's triangle nearest to the point
  };
  struct PerTriangle {
    /// Upper bound over the triangle's points. Unless negligible, it exceeds the largest distance
    /// by at most the precision (more if ten bisections do not suffice).
    float distance = 0;
    Vec3 position;  ///< the furthest point evaluated
    std::vector<Listed> listed;
    std::vector<std::uint32_t> witnesses;  ///< triangles of the other mesh that bound the distance
  };
  std::vector<PerTriangle> triangles;
  std::vector<std::uint32_t> nearest;  ///< the other mesh's nearest triangle, per point
};

/// An earlier deviation of meshes that share some of their triangles with the present ones.
struct KnownDeviation {
  static constexpr std::uint32_t kNew = 0xffffffffu;
  const Deviation& last;
  std::vector<std::uint32_t> former_index;  ///< former index per triangle, or kNew
  /// Present index per former triangle of the other mesh, or kNew. Unused if is_other_same.
  std::vector<std::uint32_t> present_index;
  /// True if the other mesh has not changed: then large distances remain valid too.
  bool is_other_same = false;
};

/// Measures the distances of `mesh` from `other`. Triangles are subdivided until their corners
/// bound the distance closely enough (after Guthe, Borodin and Klein, Fast and accurate Hausdorff
/// distance calculation between meshes, 2005). `hints` per point: see MeshQuery.
Deviation measure_deviation(MeshView mesh, const MeshQuery& other,
                            const DeviationSettings& settings,
                            std::vector<std::uint32_t> hints = {},
                            const KnownDeviation* known = nullptr);

}  // namespace polymorph
