#include "mesh/fairing.h"

#include <algorithm>
#include <vector>

#include "mesh/fans.h"
#include "mesh/mesh_query.h"

namespace polymorph {
namespace {

using Vertices = std::vector<std::uint32_t>;

/// Returns the seeds, followed by the vertices within `rings` edges of them.
Vertices add_rings(const Mesh& mesh, const Fans& fans, std::span<const std::uint32_t> seeds,
                   int rings) {
  std::vector<std::uint8_t> is_listed(mesh.positions.size(), 0);
  Vertices list(seeds.begin(), seeds.end());
  for (const std::uint32_t v : list) is_listed[v] = 1;
  std::size_t begin = 0;
  for (int ring = 0; ring < rings; ++ring) {
    const std::size_t end = list.size();
    for (; begin < end; ++begin)
      for (const std::uint32_t t : fans.around(list[begin]))
        for (const std::uint32_t v : mesh.triangles[t].v)
          if (!is_listed[v]) is_listed[v] = 1, list.push_back(v);
  }
  return list;
}

}  // namespace

void fair(Mesh& mesh, std::span<const std::uint32_t> vertices, int steps) {
  constexpr int kRings = 2;
  const Fans fans(mesh.positions.size(), mesh.triangles);
  const Vertices moving = add_rings(mesh, fans, vertices, kRings);
  std::vector<Vec3> next(moving.size());
  for (int step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < moving.size(); ++i) {
      Vec3 sum;  // has each neighbour twice, from the two triangles at the common edge
      float count = 0;
      for (const std::uint32_t t : fans.around(moving[i]))
        for (const std::uint32_t v : mesh.triangles[t].v)
          if (v != moving[i]) sum = sum + mesh.positions[v], ++count;
      next[i] = mesh.positions[moving[i]] * 0.5f + sum * (0.5f / count);
    }
    for (std::size_t i = 0; i < moving.size(); ++i) mesh.positions[moving[i]] = next[i];
  }
  if (mesh.normals.empty()) return;
  for (const std::uint32_t v : add_rings(mesh, fans, moving, /*rings=*/1)) {
    Vec3 sum;
    for (const std::uint32_t t : fans.around(v))
      sum = sum + area_normal(mesh.positions, mesh.triangles[t]);
    mesh.normals[v] = normalized(sum);
  }
}

std::size_t repair_normals(Mesh& mesh) {
  constexpr float kMinCosine = -0.2f;  // between a vertex normal and a triangle's normal
  std::vector<std::uint8_t> is_wrong(mesh.normals.size(), 0);
  if (mesh.normals.empty()) return 0;  // flat shading
  for (const Triangle& t : mesh.triangles) {
    const Vec3 normal = area_normal(mesh.positions, t);
    const float limit = kMinCosine * length(normal);
    for (const std::uint32_t v : t.v) is_wrong[v] |= dot(normal, mesh.normals[v]) < limit;
  }
  const auto count =
      static_cast<std::size_t>(std::count(is_wrong.begin(), is_wrong.end(), std::uint8_t{1}));
  if (count == 0) return 0;
  for (std::size_t v = 0; v < is_wrong.size(); ++v)
    if (is_wrong[v]) mesh.normals[v] = {};
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t.v)
      if (is_wrong[v]) mesh.normals[v] = mesh.normals[v] + area_normal(mesh.positions, t);
  for (std::size_t v = 0; v < is_wrong.size(); ++v)
    if (is_wrong[v]) mesh.normals[v] = normalized(mesh.normals[v]);
  return count;
}

}  // namespace polymorph
