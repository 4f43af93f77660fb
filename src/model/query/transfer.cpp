#include "model/query/transfer.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "base/result.h"
#include "image/texture.h"

namespace polymorph {
namespace {

Vec2 mixed(const Model& model, std::uint32_t triangle, const TriangleWeights& w) {
  const std::size_t c = 3 * std::size_t{triangle};
  return model.corner_uvs[c] * static_cast<float>(w.a) +
         model.corner_uvs[c + 1] * static_cast<float>(w.b) +
         model.corner_uvs[c + 2] * static_cast<float>(w.c);
}

/// Barycentric coordinates of p's projection onto the triangle's plane, outside of it, too.
TriangleWeights weights_in_plane(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 e = b - a, f = c - a, d = p - a;
  const double ee = static_cast<double>(dot(e, e)), ef = static_cast<double>(dot(e, f)),
               ff = static_cast<double>(dot(f, f)), de = static_cast<double>(dot(d, e)),
               df = static_cast<double>(dot(d, f));
  const double area = ee * ff - ef * ef;
  if (!(area > 0)) return {};
  const double v = (ff * de - ef * df) / area, w = (ee * df - ef * de) / area;
  return {1 - v - w, v, w};
}

float spread(const std::array<Vec2, 3>& uv) {
  float largest = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec2 d = uv[i] + uv[(i + 1) % 3] * -1.0f;
    largest = std::max({largest, std::abs(d.x), std::abs(d.y)});
  }
  return largest;
}

/// The texture there.
Vec2 uv_of(const Model& model, const ClosestPoint& hit) {
  const auto& v = model.triangles[hit.triangle].v;
  return mixed(
      model, hit.triangle,
      closest_on_triangle(hit.point, model.points[v[0]], model.points[v[1]], model.points[v[2]]));
}

Vec3 mean(const std::array<Vec3, 3>& corners) {
  return (corners[0] + corners[1] + corners[2]) / 3.0f;
}

/// White where the material has no texture.
Vec3 texel(const Model& model, std::uint32_t material, Vec2 uv) {
  const int index = model.materials[material].texture;
  const auto texture = static_cast<std::size_t>(std::max(index, 0));
  if (index < 0 || texture >= model.textures.size() || !model.textures[texture]) return {1, 1, 1};
  return sample_texture(*model.textures[texture], uv);
}

/// Colours that nobody tells apart side by side: within five steps of 255, about.
bool look_alike(Vec3 a, Vec3 b) {
  constexpr float kStep = 0.02f;
  const auto near = [](float x, float y) {
    return std::abs(std::sqrt(std::max(x, 0.0f)) - std::sqrt(std::max(y, 0.0f))) < kStep;
  };
  return near(a.x, b.x) && near(a.y, b.y) && near(a.z, b.z);
}

/// The texture at the triangle's middle, continued to its corners.
void continue_chart(const Model& model, const ClosestPoint& middle,
                    const std::array<Vec3, 3>& corners, Vec2 (&uv)[3]) {
  const auto& v = model.triangles[middle.triangle].v;
  const Vec3 a = model.points[v[0]], b = model.points[v[1]], c = model.points[v[2]];
  const Vec2 at_middle = uv_of(model, middle);
  for (int k = 0; k < 3; ++k) {
    const TriangleWeights w = weights_in_plane(corners[k], a, b, c);
    // Far beyond a small triangle its plane says nothing any more.
    const bool near = std::max({std::abs(w.a), std::abs(w.b), std::abs(w.c)}) < 4;
    uv[k] = near ? mixed(model, middle.triangle, w) : at_middle;
  }
}

}  // namespace

std::vector<std::uint32_t> texture_charts(const Model& model) {
  struct Edge {
    std::uint32_t low, high, triangle;
    int first;  ///< corner at `low`
    int second;
  };
  std::vector<Edge> edges;
  for (std::uint32_t t = 0; t < model.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const std::uint32_t p = model.triangles[t].v[k], q = model.triangles[t].v[next];
      edges.push_back(p < q ? Edge{p, q, t, k, next} : Edge{q, p, t, next, k});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.low != b.low     ? a.low < b.low
           : a.high != b.high ? a.high < b.high
                              : a.triangle < b.triangle;
  });
  const auto uv = [&](const Edge& e, int corner) {
    return model.corner_uvs[3 * std::size_t{e.triangle} + static_cast<std::size_t>(corner)];
  };
  const auto together = [&](const Edge& a, const Edge& b) {
    if (!model.triangle_materials.empty() &&
        model.triangle_materials[a.triangle] != model.triangle_materials[b.triangle])
      return false;
    return model.corner_uvs.empty() ||
           (uv(a, a.first) == uv(b, b.first) && uv(a, a.second) == uv(b, b.second));
  };
  DisjointSets charts(model.triangles.size());
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t k = i + 1;
         k < edges.size() && edges[k].low == edges[i].low && edges[k].high == edges[i].high; ++k) {
      if (together(edges[i], edges[k])) charts.join(edges[i].triangle, edges[k].triangle);
    }
  std::vector<std::uint32_t> chart_of(model.triangles.size());
  for (std::uint32_t t = 0; t < chart_of.size(); ++t) chart_of[t] = charts.find(t);
  return chart_of;
}

TransferredMaterials transfer_materials(const Model& model, const ClosestPointQuery& closest,
                                        std::span<const std::uint32_t> charts,
                                        std::span<const Vec3> at,
                                        std::span<const Triangle> triangles) {
  PM_CHECK(charts.size() == model.triangles.size());
  constexpr float kFarApart = 0.1f;  // of the texture: nothing that one small triangle shows
  TransferredMaterials out;
  out.triangle_materials.resize(triangles.size());
  const bool textured = !model.corner_uvs.empty();
  const std::vector<std::uint32_t>& materials = model.triangle_materials;
  if (!textured && std::adjacent_find(materials.begin(), materials.end(), std::not_equal_to<>()) ==
                       materials.end()) {
    // One material everywhere: nobody need ask where.
    if (!materials.empty())
      std::fill(out.triangle_materials.begin(), out.triangle_materials.end(), materials.front());
    return out;
  }
  const std::vector<ClosestPoint> hits = closest.closest(at);
  // A vertex has some six corners: what it has alone is worked out once.
  std::vector<Vec2> uv_at(textured ? at.size() : 0);
  if (textured) {
    out.corner_uvs.resize(triangles.size() * 3);
    parallel_for(
        static_cast<std::int64_t>(at.size()),
        [&](std::int64_t k) {
          const ClosestPoint& hit = hits[static_cast<std::size_t>(k)];
          if (hit.triangle == ClosestPoint::kNoTriangle) return;
          uv_at[static_cast<std::size_t>(k)] = uv_of(model, hit);
        },
        256);
  }
  // Without a texture only materials have borders.
  const std::span<const std::uint32_t> areas = textured ? charts : std::span(materials);
  const auto crosses_border = [&](const Triangle& t) {
    const auto& [a, b, c] = t.v;
    const std::uint32_t area = areas[hits[a].triangle];
    return area != areas[hits[b].triangle] || area != areas[hits[c].triangle] ||
           (textured && spread({uv_at[a], uv_at[b], uv_at[c]}) > kFarApart);
  };
  std::vector<std::uint8_t> crosses(triangles.size());
  parallel_for(
      static_cast<std::int64_t>(triangles.size()),
      [&](std::int64_t k) {
        const auto t = static_cast<std::size_t>(k);
        const auto& v = triangles[t].v;
        crosses[t] = crosses_border(triangles[t]);
        if (!materials.empty()) out.triangle_materials[t] = materials[hits[v[0]].triangle];
        if (!textured) return;
        for (std::size_t c = 0; c < 3; ++c) out.corner_uvs[3 * t + c] = uv_at[v[c]];
      },
      256);
  std::vector<std::uint32_t> crossing;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (crosses[t]) crossing.push_back(t);
  std::vector<BorderTriangle> borders(crossing.size());
  std::vector<std::uint8_t> shows(crossing.size());
  parallel_for(
      static_cast<std::int64_t>(crossing.size()),
      [&](std::int64_t k) {
        const std::size_t t = crossing[static_cast<std::size_t>(k)];
        const auto& v = triangles[t].v;
        BorderTriangle& border = borders[static_cast<std::size_t>(k)];
        border.at = {at[v[0]], at[v[1]], at[v[2]]};
        border.middle = closest.closest(mean(border.at), border.at[0], hits[v[0]]);
        const std::uint32_t material = materials.empty() ? 0 : materials[border.middle.triangle];
        out.triangle_materials[t] = material;
        Vec2 uv[3] = {};
        if (textured) {
          continue_chart(model, border.middle, border.at, uv);
          std::copy(uv, uv + 3, &out.corner_uvs[3 * t]);
        }
        for (std::size_t c = 0; c < 3; ++c) {
          const std::uint32_t own = materials.empty() ? 0 : materials[hits[v[c]].triangle];
          if (own != material || (textured && !look_alike(texel(model, material, uv[c]),
                                                          texel(model, own, uv_at[v[c]]))))
            shows[static_cast<std::size_t>(k)] = 1;
        }
      },
      64);
  for (std::size_t k = 0; k < crossing.size(); ++k) {
    if (!shows[k]) continue;
    out.border_of.resize(triangles.size(), TransferredMaterials::kNoBorder);
    out.border_of[crossing[k]] = static_cast<std::uint32_t>(out.borders.size());
    out.borders.push_back(borders[k]);
  }
  return out;
}

TexturePoint texture_point(const Model& model, const ClosestPointQuery& closest,
                           const BorderTriangle& triangle, float u, float v) {
  const auto& [a, b, c] = triangle.at;
  const ClosestPoint hit =
      closest.closest(a * (1 - u - v) + b * u + c * v, mean(triangle.at), triangle.middle);
  return {model.triangle_materials.empty() ? 0 : model.triangle_materials[hit.triangle],
          model.corner_uvs.empty() ? Vec2{} : uv_of(model, hit)};
}

}  // namespace polymorph
