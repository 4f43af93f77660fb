#include "mesh/mesh_check.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "base/hash.h"
#include "kernels/linear.h"
#include "mesh/components.h"
#include "mesh/edges.h"
#include "mesh/mesh_query.h"

namespace polymorph {
double volume_of(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    sum += dot(Vec3d(mesh.positions[t.v[0]]),
               cross(Vec3d(mesh.positions[t.v[1]]), Vec3d(mesh.positions[t.v[2]]))) /
           6;
  return sum;
}

double area_of(const Mesh& mesh) {
  double doubled_area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a(mesh.positions[t.v[0]]);
    doubled_area +=
        length(cross(Vec3d(mesh.positions[t.v[1]]) - a, Vec3d(mesh.positions[t.v[2]]) - a));
  }
  return 0.5 * doubled_area;
}

double faceting_loss(const Mesh& mesh) {
  if (mesh.normals.empty()) return 0;
  // An edge's midpoint lies below the surface by dot(edge, change of normal) / 8. The height above
  // the facet is a quadratic polynomial; its mean over the triangle is a third of the sum of the
  // three midpoint heights.
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    Vec3d p[3], n[3];
    for (int i = 0; i < 3; ++i)
      p[i] = Vec3d(mesh.positions[t.v[i]]), n[i] = Vec3d(mesh.normals[t.v[i]]);
    double heights = 0;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      heights += dot(p[j] - p[i], n[j] - n[i]) / 8;
    }
    sum += 0.5 * length(cross(p[1] - p[0], p[2] - p[0])) * heights / 3;
  }
  return sum;
}

std::string mesh_digest(const Mesh& mesh) {
  return Hasher()
      .add(std::span<const Vec3>(mesh.positions))
      .add(std::span<const Vec3>(mesh.normals))
      .add(std::span<const Triangle>(mesh.triangles))
      .hex();
}

MeshReport check_mesh(const Mesh& mesh) {
  MeshReport report;
  report.vertices = mesh.positions.size();
  report.triangles = mesh.triangles.size();
  report.volume = volume_of(mesh);
  report.digest = mesh_digest(mesh);
  const std::vector<EdgeUse> uses = sorted_edge_uses(mesh.triangles);
  std::size_t edge_count = 0;
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    ++edge_count;
    if (last - first != 2)
      ++report.open_edges;
    else if (uses[first].forward == uses[first + 1].forward)
      ++report.flipped_edges;
  });
  const std::vector<std::uint32_t> fans = count_fans(mesh.positions.size(), mesh.triangles, uses);
  report.pinched_vertices = static_cast<std::size_t>(
      std::count_if(fans.begin(), fans.end(), [](std::uint32_t n) { return n > 1; }));
  for (const Triangle& t : mesh.triangles) {
    const float doubled_area = length(area_normal(mesh.positions, t));
    report.area += 0.5 * doubled_area;
    if (doubled_area <= 0) ++report.degenerate_triangles;
    for (int k = 0; k < 3; ++k)  // sides of length 0, which `uses` leaves out
      if (t.v[k] == t.v[(k + 1) % 3]) ++edge_count, ++report.open_edges;
  }
  report.components = count_components(mesh);
  report.euler = static_cast<long long>(report.vertices) - static_cast<long long>(edge_count) +
                 static_cast<long long>(report.triangles);
  report.genus = static_cast<long long>(report.components) - report.euler / 2;
  return report;
}

}  // namespace polymorph
