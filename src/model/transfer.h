// Attribute transfer: gives a surface the materials and texture coordinates of a model near it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/closest.h"
#include "model/model.h"

namespace polymorph {

/// Returns the chart of the texture to which each triangle belongs, as a number per triangle.
/// Adjacent triangles belong to one chart if they have the same material, and the same texture
/// coordinates along their common edge.
std::vector<std::uint32_t> find_texture_charts(const Model& model);

/// A triangle that crosses a border of the model's charts or materials, with different colours or
/// materials on the border's two sides.
struct BorderTriangle {
  std::array<Vec3, 3> corners;  ///< points of the model, or near it
  ClosestPoint center_hit;      ///< the model's point closest to the mean of `corners`
};

/// Materials and texture coordinates of a surface, in the form that Model has them.
struct TransferredMaterials {
  static constexpr std::uint32_t kNoBorder = 0xffffffffu;
  std::vector<Vec2> corner_uvs;                   ///< 3 per triangle; empty if the model has none
  std::vector<std::uint32_t> triangle_materials;  ///< one per triangle, as in Model
  std::vector<BorderTriangle> borders;
  /// Index in `borders` per triangle, or kNoBorder; empty if there are no borders.
  std::vector<std::uint32_t> border_index;
};

/// Points, one per vertex of a surface, at which a model's attributes are looked up: the vertices
/// themselves or, if the surface has moved away from the model, the points to which they are mapped
/// back.
struct Origins {
  std::span<const Vec3> places;
  /// The model's closest point for each of `places`; empty if not yet computed.
  std::span<const ClosestPoint> closest = {};
};

/// Gives each corner of a triangle the texture coordinates of the model at the point closest to its
/// vertex's origin, and each triangle the material at its first corner. If the corners of a
/// triangle fall into several charts, or far apart in the texture, the triangle has the material at
/// its centroid, and the chart there is extrapolated to its corners, so that no texture is smeared
/// across a seam. The border between charts then runs along triangle edges; texture_point() finds
/// its exact course.
TransferredMaterials transfer_materials(const Model& model, const ClosestPointQuery& closest,
                                        std::span<const std::uint32_t> charts,
                                        const Origins& origins,
                                        std::span<const Triangle> triangles);

/// A material of the model and texture coordinates.
struct TexturePoint {
  std::uint32_t material = 0;
  Vec2 uv;
};

/// Non-owning view of the arrays that a texture lookup at a closest point needs. `corner_uvs` and
/// `triangle_materials` may be empty.
struct TexturedTriangles {
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  std::span<const Vec2> corner_uvs;
  std::span<const std::uint32_t> triangle_materials;
};

/// Interpolates texture coordinates at barycentric weights of a triangle.
PM_HD inline Vec2 interpolate_uv(std::span<const Vec2> corner_uvs, std::uint32_t triangle,
                                 const TriangleWeights& w) {
  const Vec2* uv = &corner_uvs[3 * std::size_t{triangle}];
  return uv[0] * static_cast<float>(w.a) + uv[1] * static_cast<float>(w.b) +
         uv[2] * static_cast<float>(w.c);
}

/// Looks up the material and texture coordinates of the model at a closest point.
PM_HD inline TexturePoint texture_point(const TexturedTriangles& source, const ClosestPoint& hit) {
  TexturePoint point;
  if (!source.triangle_materials.empty()) point.material = source.triangle_materials[hit.triangle];
  if (source.corner_uvs.empty()) return point;
  const std::uint32_t* v = source.triangles[hit.triangle].v;
  point.uv = interpolate_uv(source.corner_uvs, hit.triangle,
                            closest_on_triangle(hit.point, source.points[v[0]], source.points[v[1]],
                                                source.points[v[2]]));
  return point;
}

/// Looks up the material and texture coordinates of the model at the point closest to a point of a
/// border triangle. `u` and `v` are the barycentric weights of its second and third corner.
/// `closest(point, neighbour, neighbour_hit)` finds the model's point closest to `point`, as
/// ClosestPointQuery::closest() does.
template <class Closest>
PM_HD TexturePoint texture_point(const TexturedTriangles& source, const BorderTriangle& border,
                                 float u, float v, const Closest& closest) {
  const Vec3 a = border.corners[0], b = border.corners[1], c = border.corners[2];
  return texture_point(
      source, closest(a * (1 - u - v) + b * u + c * v, (a + b + c) / 3.0f, border.center_hit));
}
/// Looks up a point of a border triangle in a Model, with the model's ClosestPointQuery.
TexturePoint texture_point(const Model& model, const ClosestPointQuery& closest,
                           const BorderTriangle& border, float u, float v);

}  // namespace polymorph
