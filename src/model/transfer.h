// Attribute transfer: a model's materials and texture coordinates on another surface near it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/closest.h"
#include "model/model.h"

namespace polymorph {

/// Which triangles hang together in the texture: one number per triangle. Two triangles are of one
/// chart when they share an edge, its texture coordinates and the material.
std::vector<std::uint32_t> texture_charts(const Model& model);

/// A triangle across a border of the model's charts or materials, on both sides of which there are
/// different colours or materials.
struct BorderTriangle {
  std::array<Vec3, 3> at;  ///< where its corners are on the model, or near it
  ClosestPoint middle;     ///< of their mean
};

/// As in Model.
struct TransferredMaterials {
  static constexpr std::uint32_t kNoBorder = 0xffffffffu;
  std::vector<Vec2> corner_uvs;  ///< 3 per triangle; empty where the model has none
  std::vector<std::uint32_t> triangle_materials;
  std::vector<BorderTriangle> borders;
  /// Of each triangle its number among `borders`, or kNoBorder; empty where there are none.
  std::vector<std::uint32_t> border_of;
};

/// Gives each vertex of a surface what the model has at the point nearest to `at` (one per vertex:
/// the vertex itself, or where it was pulled back to). A triangle whose corners fall into several
/// charts or far apart in the texture takes the chart at its middle, continued to its corners, so
/// that no texture is smeared across a seam. Seen close its border is as jagged as the triangles:
/// who has the time asks texture_point() instead.
TransferredMaterials transfer_materials(const Model& model, const ClosestPointQuery& closest,
                                        std::span<const std::uint32_t> charts,
                                        std::span<const Vec3> at,
                                        std::span<const Triangle> triangles);

/// A material of the model and a place on its texture.
struct TexturePoint {
  std::uint32_t material = 0;
  Vec2 uv;
};

/// What the model has nearest to a point of such a triangle; `u` and `v` are the weights of its
/// second and third corner.
TexturePoint texture_point(const Model& model, const ClosestPointQuery& closest,
                           const BorderTriangle& triangle, float u, float v);

}  // namespace polymorph
