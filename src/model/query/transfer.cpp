#include "model/query/transfer.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "base/result.h"

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

float spread(const Vec2 (&uv)[3]) {
  float largest = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec2 d = uv[i] + uv[(i + 1) % 3] * -1.0f;
    largest = std::max({largest, std::abs(d.x), std::abs(d.y)});
  }
  return largest;
}

/// The texture at the triangle's middle, continued to its corners.
void continue_chart(const Model& model, const ClosestPoint& middle, const Vec3 (&corners)[3],
                    Vec2 (&uv)[3]) {
  const auto& v = model.triangles[middle.triangle].v;
  const Vec3 a = model.points[v[0]], b = model.points[v[1]], c = model.points[v[2]];
  const Vec2 at_middle = mixed(model, middle.triangle, closest_on_triangle(middle.point, a, b, c));
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
          const auto& m = model.triangles[hit.triangle].v;
          uv_at[static_cast<std::size_t>(k)] =
              mixed(model, hit.triangle,
                    closest_on_triangle(hit.point, model.points[m[0]], model.points[m[1]],
                                        model.points[m[2]]));
        },
        256);
  }
  parallel_for(
      static_cast<std::int64_t>(triangles.size()),
      [&](std::int64_t k) {
        const auto t = static_cast<std::size_t>(k);
        const auto& v = triangles[t].v;
        const ClosestPoint* hit[3] = {&hits[v[0]], &hits[v[1]], &hits[v[2]]};
        const bool one_chart = charts[hit[0]->triangle] == charts[hit[1]->triangle] &&
                               charts[hit[0]->triangle] == charts[hit[2]->triangle];
        Vec2 uv[3];
        if (textured && one_chart)
          for (int c = 0; c < 3; ++c) uv[c] = uv_at[v[c]];
        std::uint32_t source = hit[0]->triangle;
        if (!one_chart || (textured && spread(uv) > kFarApart)) {
          const Vec3 corners[3] = {at[v[0]], at[v[1]], at[v[2]]};
          const ClosestPoint middle =
              closest.closest((corners[0] + corners[1] + corners[2]) / 3.0f, corners[0], *hit[0]);
          source = middle.triangle;
          if (textured) continue_chart(model, middle, corners, uv);
        }
        out.triangle_materials[t] = materials.empty() ? 0 : materials[source];
        if (textured)
          for (std::size_t c = 0; c < 3; ++c) out.corner_uvs[3 * t + c] = uv[c];
      },
      64);
  return out;
}

}  // namespace polymorph
