#include "mesh/sample_surface.h"

#include "base/morton.h"
#include "base/random.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

std::vector<std::uint32_t> morton_order(MeshView mesh) {
  std::vector<Vec3> middles;
  middles.reserve(mesh.triangles.size());
  for (const auto& [v] : mesh.triangles)
    middles.push_back((mesh.points[v[0]] + mesh.points[v[1]] + mesh.points[v[2]]) / 3);
  return sort_by_morton_key(middles, mesh.box());
}

}  // namespace

std::vector<SurfaceSample> sample_surface(MeshView mesh, std::size_t count, std::uint64_t seed) {
  const std::vector<std::uint32_t> order = morton_order(mesh);
  std::vector<Vec3d> area_vectors(order.size());
  double total_area = 0;  // doubled, like all areas below
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto& v = mesh.triangles[order[i]].v;
    const Vec3d a(mesh.points[v[0]]), b(mesh.points[v[1]]), c(mesh.points[v[2]]);
    area_vectors[i] = cross(b - a, c - a);
    total_area += length(area_vectors[i]);
  }
  std::vector<SurfaceSample> samples;
  if (!(total_area > 0)) return samples;
  samples.reserve(count);
  double cumulative_area = 0;
  std::size_t next = 0;  // index of the next sample
  for (std::size_t i = 0; i < order.size() && next < count; ++i) {
    const double doubled_area = length(area_vectors[i]);
    if (!(doubled_area > 0)) continue;
    cumulative_area += doubled_area;
    const auto& v = mesh.triangles[order[i]].v;
    const Vec3 a = mesh.points[v[0]], b = mesh.points[v[1]], c = mesh.points[v[2]];
    const Vec3d n = area_vectors[i] * (1 / doubled_area);
    const Vec3 normal{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
    for (; next < count; ++next) {
      // The sample has a random position in its stratum of the cumulative area.
      const double jitter = static_cast<double>(random_float(seed, /*stream=*/0, next));
      if ((static_cast<double>(next) + jitter) / static_cast<double>(count) * total_area >
          cumulative_area)
        break;
      // Reflect points of the unit square into the triangle s + t <= 1.
      float s = random_float(seed, /*stream=*/1, next), t = random_float(seed, /*stream=*/2, next);
      if (s + t > 1) s = 1 - s, t = 1 - t;
      samples.push_back({a + (b - a) * s + (c - a) * t, normal, order[i]});
    }
  }
  return samples;
}

}  // namespace polymorph
