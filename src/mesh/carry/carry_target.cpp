#include "mesh/carry/carry_target.h"

#include <algorithm>
#include <cmath>

namespace polymorph {

CarryTarget make_carry_target(Mesh surface) {
  CarryTarget target{std::move(surface), {}, nullptr};
  const Mesh& mesh = target.surface;
  target.fans = Fans(mesh.positions.size(), mesh.triangles);
  target.tree = std::make_shared<const ClosestPointQuery>(mesh.positions, mesh.triangles);
  double area = 0;
  for (const Triangle& t : mesh.triangles)
    area += 0.5 * static_cast<double>(length(area_normal(mesh.positions, t)));
  // An equilateral triangle has edges of length sqrt(4 / sqrt 3 * area); 4 / sqrt 3 = 2.3094.
  if (!mesh.triangles.empty())
    target.edge =
        static_cast<float>(std::sqrt(2.3094 * area / static_cast<double>(mesh.triangles.size())));
  return target;
}

ClosestPoint closest_near(const CarryTarget& target, Vec3 from, std::uint32_t hint) {
  constexpr int kMaxSteps = 12;
  const Mesh& mesh = target.surface;
  if (hint >= mesh.triangles.size()) return target.tree->closest(from);
  const auto weights_in = [&](std::uint32_t f) {
    const Triangle& t = mesh.triangles[f];
    return closest_on_triangle(from, mesh.positions[t.v[0]], mesh.positions[t.v[1]],
                               mesh.positions[t.v[2]]);
  };
  const auto point_in = [&](std::uint32_t f, const TriangleWeights& w) {
    const Triangle& t = mesh.triangles[f];
    const Vec3 a = mesh.positions[t.v[0]];
    return a + (mesh.positions[t.v[1]] - a) * static_cast<float>(w.b) +
           (mesh.positions[t.v[2]] - a) * static_cast<float>(w.c);
  };
  TriangleWeights w = weights_in(hint);
  ClosestPoint best{point_in(hint, w), 0, hint};
  best.distance = length(best.point - from);
  for (int step = 0;; ++step) {
    if (w.a > 0 && w.b > 0 && w.c > 0) break;
    // The closest point lies on a side or at a corner: look at the triangles around one of its
    // ends.
    const std::uint32_t f = best.triangle;
    const int corner = w.a >= w.b && w.a >= w.c ? 0 : w.b >= w.c ? 1 : 2;
    for (const std::uint32_t g : target.fans.around(mesh.triangles[f].v[corner])) {
      if (g == f) continue;
      const TriangleWeights v = weights_in(g);
      const Vec3 point = point_in(g, v);
      const float distance = length(point - from);
      if (distance < best.distance) best = {point, distance, g}, w = v;
    }
    if (best.triangle == f) break;
    if (step == kMaxSteps) return target.query().closest(from, best.triangle);
  }
  return best.distance <= 2 * target.edge ? best : target.query().closest(from, best.triangle);
}

Vec3 face_normal_at(const CarryTarget& target, Vec3 from, const ClosestPoint& hit, Vec3 facing) {
  const Mesh& mesh = target.surface;
  const Triangle& t = mesh.triangles[hit.triangle];
  const TriangleWeights w = closest_on_triangle(from, mesh.positions[t.v[0]],
                                                mesh.positions[t.v[1]], mesh.positions[t.v[2]]);
  Vec3 normal = normalized(area_normal(mesh.positions, t));
  if (w.a > 0 && w.b > 0 && w.c > 0) return normal;
  // The corners with a positive weight: the two of an edge, or one.
  std::vector<std::uint32_t> corners;
  for (int k = 0; k < 3; ++k)
    if ((k == 0 ? w.a : k == 1 ? w.b : w.c) > 0) corners.push_back(t.v[k]);
  for (const std::uint32_t f : target.fans.around(corners.front())) {
    const auto& v = mesh.triangles[f].v;
    if (corners.size() == 2 && std::find(v, v + 3, corners.back()) == v + 3) continue;
    const Vec3 n = area_normal(mesh.positions, mesh.triangles[f]);
    if (dot(n, n) > 0 && dot(normalized(n), facing) < dot(normal, facing)) normal = normalized(n);
  }
  return normal;
}

}  // namespace polymorph
