// Attribute transfer: a model's materials and texture coordinates on another surface near it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "model/model.h"
#include "model/query/closest.h"

namespace polymorph {

/// Which triangles hang together in the texture: one number per triangle. Two triangles are of one
/// chart when they share an edge, its texture coordinates and the material.
std::vector<std::uint32_t> texture_charts(const Model& model);

/// As in Model.
struct TransferredMaterials {
  std::vector<Vec2> corner_uvs;  ///< 3 per triangle; empty where the model has none
  std::vector<std::uint32_t> triangle_materials;
};

/// Gives each vertex of a surface what the model has at the point nearest to `at` (one per vertex:
/// the vertex itself, or where it was pulled back to). A triangle whose corners fall into several
/// charts or far apart in the texture takes the chart at its middle, continued to its corners, so
/// that no texture is smeared across a seam.
TransferredMaterials transfer_materials(const Model& model, const ClosestPointQuery& closest,
                                        std::span<const std::uint32_t> charts,
                                        std::span<const Vec3> at,
                                        std::span<const Triangle> triangles);

}  // namespace polymorph
