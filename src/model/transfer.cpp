#include "model/transfer.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "base/result.h"
#include "image/texture.h"
#include "mesh/edges.h"

namespace polymorph {
namespace {

/// Barycentric coordinates of the projection of p onto the triangle's plane; p may lie outside the
/// triangle. A triangle without area gives those of corner a.
TriangleWeights barycentric_in_plane(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double bb = static_cast<double>(dot(ab, ab)), bc = static_cast<double>(dot(ab, ac)),
               cc = static_cast<double>(dot(ac, ac)), pb = static_cast<double>(dot(ap, ab)),
               pc = static_cast<double>(dot(ap, ac));
  const double determinant = bb * cc - bc * bc;
  if (!(determinant > 0)) return {};
  const double v = (cc * pb - bc * pc) / determinant, w = (bb * pc - bc * pb) / determinant;
  return {1 - v - w, v, w};
}

/// Largest distance between two of the corners, along u or v.
float uv_extent(const std::array<Vec2, 3>& uv) {
  float largest = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec2 d = uv[i] + uv[(i + 1) % 3] * -1.0f;
    largest = std::max({largest, std::abs(d.x), std::abs(d.y)});
  }
  return largest;
}

/// Index of a triangle's material; 0 for a model without materials.
std::uint32_t material_at(const Model& model, std::uint32_t triangle) {
  return model.triangle_materials.empty() ? 0 : model.triangle_materials[triangle];
}

/// Texture coordinates at a closest point.
Vec2 uv_at(const Model& model, const ClosestPoint& hit) {
  return interpolate_uv(model.corner_uvs, hit.triangle, weights_at(model, hit));
}

Vec3 mean(const std::array<Vec3, 3>& corners) {
  return (corners[0] + corners[1] + corners[2]) / 3.0f;
}

/// The texture's colour, or white if the material has none.
Vec3 texel(const Model& model, std::uint32_t material, Vec2 uv) {
  const int index = model.materials[material].texture;
  const auto texture = static_cast<std::size_t>(std::max(index, 0));
  if (index < 0 || texture >= model.textures.size() || !model.textures[texture]) return {1, 1, 1};
  return sample_texture(*model.textures[texture], uv);
}

/// Tests whether two scene-linear colours are indistinguishable side by side: with the square root
/// as an approximation of the sRGB curve, all components differ by less than about five steps of
/// 255.
bool look_alike(Vec3 a, Vec3 b) {
  constexpr float kTolerance = 0.02f;
  const auto is_near = [](float x, float y) {
    return std::abs(std::sqrt(std::max(x, 0.0f)) - std::sqrt(std::max(y, 0.0f))) < kTolerance;
  };
  return is_near(a.x, b.x) && is_near(a.y, b.y) && is_near(a.z, b.z);
}

/// Extrapolates the texture coordinates of the model's triangle at `middle` to the given corners.
std::array<Vec2, 3> continue_chart(const Model& model, const ClosestPoint& middle,
                                   const std::array<Vec3, 3>& corners) {
  const auto& v = model.triangles[middle.triangle].v;
  const Vec3 a = model.points[v[0]], b = model.points[v[1]], c = model.points[v[2]];
  std::array<Vec2, 3> uv;
  uv.fill(uv_at(model, middle));
  for (std::size_t k = 0; k < 3; ++k) {
    const TriangleWeights w = barycentric_in_plane(corners[k], a, b, c);
    // An extrapolation by several triangle widths is meaningless; such a corner keeps the
    // coordinates at `middle`.
    if (std::max({std::abs(w.a), std::abs(w.b), std::abs(w.c)}) < 4)
      uv[k] = interpolate_uv(model.corner_uvs, middle.triangle, w);
  }
  return uv;
}

/// Closest point and texture coordinates of each vertex, looked up once for the about six corners
/// that share it.
struct Nearest {
  std::vector<ClosestPoint> hits;
  std::vector<Vec2> uvs;  ///< empty if the model has no texture coordinates
};
Nearest find_nearest(const Model& model, const ClosestPointQuery& closest, const Origins& origins) {
  Nearest nearest = {{origins.closest.begin(), origins.closest.end()}, {}};
  if (nearest.hits.empty()) nearest.hits = closest.closest(origins.places);
  if (model.corner_uvs.empty()) return nearest;
  nearest.uvs.resize(nearest.hits.size());
  parallel_for(
      static_cast<std::int64_t>(nearest.hits.size()),
      [&](std::int64_t index) {
        const auto k = static_cast<std::size_t>(index);
        if (nearest.hits[k].triangle != ClosestPoint::kNoTriangle)
          nearest.uvs[k] = uv_at(model, nearest.hits[k]);
      },
      /*grain=*/256);
  return nearest;
}

/// Tests whether the triangle's corners fall into several areas (charts or materials), or so far
/// apart in the texture that a small triangle cannot lie in one chart. `areas`: one per model
/// triangle.
bool crosses_border(const Nearest& nearest, std::span<const std::uint32_t> areas,
                    const Triangle& triangle) {
  constexpr float kFarApart = 0.1f;  // fraction of the texture's size
  const auto& [a, b, c] = triangle.v;
  const std::uint32_t area = areas[nearest.hits[a].triangle];
  if (area != areas[nearest.hits[b].triangle] || area != areas[nearest.hits[c].triangle])
    return true;
  const std::vector<Vec2>& uv = nearest.uvs;
  return !uv.empty() && uv_extent({uv[a], uv[b], uv[c]}) > kFarApart;
}

}  // namespace

std::vector<std::uint32_t> find_texture_charts(const Model& model) {
  const std::vector<EdgeUse> uses = sorted_edge_uses(model.triangles);
  const std::vector<Vec2>& uvs = model.corner_uvs;
  const auto is_same_chart = [&](const EdgeUse& a, const EdgeUse& b) {
    return material_at(model, a.corner / 3) == material_at(model, b.corner / 3) &&
           (uvs.empty() || (uvs[low_corner(a)] == uvs[low_corner(b)] &&
                            uvs[high_corner(a)] == uvs[high_corner(b)]));
  };
  DisjointSets charts(model.triangles.size());
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      for (std::size_t k = i + 1; k < last; ++k)
        if (is_same_chart(uses[i], uses[k])) charts.join(uses[i].corner / 3, uses[k].corner / 3);
  });
  std::vector<std::uint32_t> result(model.triangles.size());
  for (std::uint32_t t = 0; t < result.size(); ++t) result[t] = charts.find(t);
  return result;
}

TransferredMaterials transfer_materials(const Model& model, const ClosestPointQuery& closest,
                                        std::span<const std::uint32_t> charts,
                                        const Origins& origins,
                                        std::span<const Triangle> triangles) {
  PM_CHECK(charts.size() == model.triangles.size());
  TransferredMaterials result;
  result.triangle_materials.resize(triangles.size());
  const bool textured = !model.corner_uvs.empty();
  const std::vector<std::uint32_t>& materials = model.triangle_materials;
  if (!textured && std::adjacent_find(materials.begin(), materials.end(), std::not_equal_to<>()) ==
                       materials.end()) {
    // There is one material everywhere, so positions do not matter.
    if (!materials.empty())
      std::fill(result.triangle_materials.begin(), result.triangle_materials.end(),
                materials.front());
    return result;
  }
  const Nearest nearest = find_nearest(model, closest, origins);
  if (textured) result.corner_uvs.resize(triangles.size() * 3);
  // Without texture coordinates there are no charts, only areas of equal material.
  const std::span<const std::uint32_t> areas = textured ? charts : std::span(materials);
  // First, each corner takes the attributes of its closest point.
  std::vector<std::uint8_t> is_crossing(triangles.size());
  parallel_for(
      static_cast<std::int64_t>(triangles.size()),
      [&](std::int64_t k) {
        const auto t = static_cast<std::size_t>(k);
        const auto& v = triangles[t].v;
        is_crossing[t] = crosses_border(nearest, areas, triangles[t]);
        result.triangle_materials[t] = material_at(model, nearest.hits[v[0]].triangle);
        if (!textured) return;
        for (std::size_t c = 0; c < 3; ++c) result.corner_uvs[3 * t + c] = nearest.uvs[v[c]];
      },
      /*grain=*/256);
  std::vector<std::uint32_t> crossing_triangles;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (is_crossing[t]) crossing_triangles.push_back(t);
  // Then each triangle that crosses a border takes the chart and material at its centroid. The
  // border is visible if that changes the material or colour of a corner.
  std::vector<BorderTriangle> borders(crossing_triangles.size());
  std::vector<std::uint8_t> is_visible(crossing_triangles.size());
  parallel_for(
      static_cast<std::int64_t>(crossing_triangles.size()),
      [&](std::int64_t index) {
        const auto k = static_cast<std::size_t>(index);
        const std::size_t t = crossing_triangles[k];
        const auto& v = triangles[t].v;
        BorderTriangle& border = borders[k];
        border.corners = {origins.places[v[0]], origins.places[v[1]], origins.places[v[2]]};
        border.center_hit =
            closest.closest(mean(border.corners), border.corners[0], nearest.hits[v[0]]);
        result.triangle_materials[t] = material_at(model, border.center_hit.triangle);
        std::array<Vec2, 3> uv{};
        if (textured) {
          uv = continue_chart(model, border.center_hit, border.corners);
          std::copy(uv.begin(), uv.end(), &result.corner_uvs[3 * t]);
        }
        for (std::size_t c = 0; c < 3 && !is_visible[k]; ++c) {
          const std::uint32_t material = material_at(model, nearest.hits[v[c]].triangle);
          is_visible[k] = material != result.triangle_materials[t] ||
                          (textured && !look_alike(texel(model, material, uv[c]),
                                                   texel(model, material, nearest.uvs[v[c]])));
        }
      },
      /*grain=*/64);
  for (std::size_t k = 0; k < crossing_triangles.size(); ++k) {
    if (!is_visible[k]) continue;
    // The first visible border allocates the indices.
    result.border_index.resize(triangles.size(), TransferredMaterials::kNoBorder);
    result.border_index[crossing_triangles[k]] = static_cast<std::uint32_t>(result.borders.size());
    result.borders.push_back(borders[k]);
  }
  return result;
}

TexturePoint texture_point(const Model& model, const ClosestPointQuery& closest,
                           const BorderTriangle& border, float u, float v) {
  return texture_point({model.points, model.triangles, model.corner_uvs, model.triangle_materials},
                       border, u, v, [&](Vec3 from, Vec3 neighbour, const ClosestPoint& hit) {
                         return closest.closest(from, neighbour, hit);
                       });
}

}  // namespace polymorph
