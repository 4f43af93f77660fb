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
  const MeshQuery query = target.query();
  if (hint < query.triangles.size())
    if (const auto hit = query.walk_to_closest(from, hint); hit && hit->distance <= 2 * target.edge)
      return *hit;
  return query.closest(from, hint);
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
