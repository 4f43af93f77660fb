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

MaterialTransfer::MaterialTransfer(const Model& model, const ClosestPointQuery& closest,
                                   std::span<const std::uint32_t> charts, const Origins& origins,
                                   std::span<const Triangle> triangles)
    : model_(model), closest_(closest) {
  PM_CHECK(charts.size() == model.triangles.size());
  const std::vector<std::uint32_t>& materials = model.triangle_materials;
  // Without texture coordinates there are no charts, only areas of equal material.
  areas_ = has_uvs() ? charts : std::span(materials);
  is_uniform_ = !has_uvs() && std::adjacent_find(materials.begin(), materials.end(),
                                                 std::not_equal_to<>()) == materials.end();
  triangles_.assign(triangles.begin(), triangles.end());
  if (is_uniform_) return;  // positions do not matter
  places_.assign(origins.places.begin(), origins.places.end());
  known_closest_.assign(origins.closest.begin(), origins.closest.end());
  corners_ = LazyValues<Corner>(places_.size());
  parts_ = LazyValues<Part>(triangles_.size());
}

MaterialTransfer::Corner MaterialTransfer::corner(std::uint32_t vertex, const Corner* neighbour,
                                                  Vec3 neighbour_place) const {
  return corners_.get(vertex, [&] {
    Corner found;
    const Vec3 place = places_[vertex];
    if (!known_closest_.empty())
      found.hit = known_closest_[vertex];
    else if (neighbour)
      found.hit = closest_.closest(place, neighbour_place, neighbour->hit);
    else
      found.hit = closest_.closest(place);
    if (has_uvs() && found.hit.triangle != ClosestPoint::kNoTriangle)
      found.uv = uv_at(model_, found.hit);
    return found;
  });
}

std::array<MaterialTransfer::Corner, 3> MaterialTransfer::corners(const Triangle& triangle) const {
  // A corner that is known, because another triangle has it, makes it faster to find its
  // neighbours.
  const auto& v = triangle.v;
  std::array<Corner, 3> found;
  const std::size_t first = corners_.is_known(v[0])   ? 0
                            : corners_.is_known(v[1]) ? 1
                            : corners_.is_known(v[2]) ? 2
                                                      : 0;
  found[first] = corner(v[first], nullptr, {});
  for (std::size_t k = 1; k < 3; ++k) {
    const std::size_t c = (first + k) % 3;
    found[c] = corner(v[c], &found[first], places_[v[first]]);
  }
  return found;
}

MaterialTransfer::Part MaterialTransfer::look_up(const Triangle& triangle,
                                                 ClosestPoint& center_hit) const {
  // First, each corner takes the attributes of its closest point.
  const std::array<Corner, 3> found = corners(triangle);
  Part part{material_at(model_, found[0].hit.triangle),
            /*has_border=*/false,
            {found[0].uv, found[1].uv, found[2].uv}};
  // The corners may fall into several areas (charts or materials), or so far apart in the texture
  // that a small triangle cannot lie in one chart.
  constexpr float kFarApart = 0.1f;  // fraction of the texture's size
  const std::uint32_t area = areas_[found[0].hit.triangle];
  const bool is_crossing = area != areas_[found[1].hit.triangle] ||
                           area != areas_[found[2].hit.triangle] ||
                           (has_uvs() && uv_extent(part.uvs) > kFarApart);
  if (!is_crossing) return part;
  // Then a triangle that crosses a border takes the chart and material at its centroid. The border
  // is visible if that changes the material or colour of a corner.
  const auto& v = triangle.v;
  const std::array<Vec3, 3> places = {places_[v[0]], places_[v[1]], places_[v[2]]};
  center_hit = closest_.closest(mean(places), places[0], found[0].hit);
  part.material = material_at(model_, center_hit.triangle);
  if (has_uvs()) part.uvs = continue_chart(model_, center_hit, places);
  for (std::size_t c = 0; c < 3 && !part.has_border; ++c) {
    const std::uint32_t material = material_at(model_, found[c].hit.triangle);
    part.has_border = material != part.material ||
                      (has_uvs() && !look_alike(texel(model_, material, part.uvs[c]),
                                                texel(model_, material, found[c].uv)));
  }
  return part;
}

TexturePoint MaterialTransfer::at(std::uint32_t triangle, float u, float v) const {
  if (is_uniform_)
    return {model_.triangle_materials.empty() ? 0 : model_.triangle_materials.front(), {}};
  const Triangle& t = triangles_[triangle];
  const Part part = parts_.get(triangle, [&] {
    ClosestPoint center_hit;
    return look_up(t, center_hit);
  });
  if (part.has_border) {
    // The closest point to one of the corners will do as a neighbour, too.
    const Vec3 a = places_[t.v[0]], b = places_[t.v[1]], c = places_[t.v[2]];
    const Vec3 place = a * (1 - u - v) + b * u + c * v;
    const ClosestPoint hit = closest_.closest(place, a, corner(t.v[0], nullptr, {}).hit);
    return texture_point(
        {model_.points, model_.triangles, model_.corner_uvs, model_.triangle_materials}, hit);
  }
  TexturePoint point{part.material, {}};
  if (has_uvs()) point.uv = part.uvs[0] * (1 - u - v) + part.uvs[1] * u + part.uvs[2] * v;
  return point;
}

TransferredMaterials MaterialTransfer::all() const {
  TransferredMaterials result;
  result.triangle_materials.resize(triangles_.size());
  if (is_uniform_) {
    if (!model_.triangle_materials.empty())
      std::fill(result.triangle_materials.begin(), result.triangle_materials.end(),
                model_.triangle_materials.front());
    return result;
  }
  if (has_uvs()) result.corner_uvs.resize(triangles_.size() * 3);
  // In the order of the vertices each is next to the one before.
  parallel_ranges(static_cast<std::int64_t>(places_.size()), /*grain=*/256,
                  [&](std::int64_t begin, std::int64_t end) {
                    Corner last;
                    for (auto i = begin; i < end; ++i)
                      last = corner(static_cast<std::uint32_t>(i), i > begin ? &last : nullptr,
                                    places_[static_cast<std::size_t>(std::max(i - 1, begin))]);
                  });
  std::vector<ClosestPoint> center_hits(triangles_.size());
  std::vector<std::uint8_t> has_border(triangles_.size());
  parallel_for(
      static_cast<std::int64_t>(triangles_.size()),
      [&](std::int64_t index) {
        const auto t = static_cast<std::size_t>(index);
        const Part part = look_up(triangles_[t], center_hits[t]);
        result.triangle_materials[t] = part.material;
        has_border[t] = part.has_border;
        if (has_uvs()) std::copy(part.uvs.begin(), part.uvs.end(), &result.corner_uvs[3 * t]);
      },
      /*grain=*/64);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    if (!has_border[t]) continue;
    // The first visible border allocates the indices.
    result.border_index.resize(triangles_.size(), TransferredMaterials::kNoBorder);
    result.border_index[t] = static_cast<std::uint32_t>(result.borders.size());
    const auto& v = triangles_[t].v;
    result.borders.push_back({{places_[v[0]], places_[v[1]], places_[v[2]]}, center_hits[t]});
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
