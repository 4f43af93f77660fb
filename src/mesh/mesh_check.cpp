#include "mesh/mesh_check.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "base/hash.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

struct Edge {
  std::uint32_t low, high;
  std::uint32_t triangle;
  bool forward;
};

std::vector<Edge> sorted_edges(const Mesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.triangles[t].v[k], b = mesh.triangles[t].v[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(t), a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) {
    return std::pair(p.low, p.high) != std::pair(q.low, q.high)
               ? std::pair(p.low, p.high) < std::pair(q.low, q.high)
               : p.triangle < q.triangle;
  });
  return edges;
}

/// Counts the vertices whose triangles form more than one fan. Corner c is 3 * triangle + k; two
/// corners at a vertex belong to one fan if their triangles share an edge there.
std::size_t count_pinched(const Mesh& mesh, const std::vector<Edge>& edges) {
  const auto corner_at = [&](std::uint32_t t, std::uint32_t vertex) {
    for (std::uint32_t k = 0; k < 3; ++k)
      if (mesh.triangles[t].v[k] == vertex) return 3 * t + k;
    return 3 * t;
  };
  DisjointSets fans(mesh.triangles.size() * 3);
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const Edge &p = edges[i], &q = edges[i + 1];
    if (p.low != q.low || p.high != q.high) continue;
    for (const std::uint32_t vertex : {p.low, p.high})
      fans.join(corner_at(p.triangle, vertex), corner_at(q.triangle, vertex));
  }
  std::vector<std::uint32_t> fan_count(mesh.positions.size(), 0);
  for (std::uint32_t c = 0; c < mesh.triangles.size() * 3; ++c)
    if (fans.find(c) == c) ++fan_count[mesh.triangles[c / 3].v[c % 3]];
  return static_cast<std::size_t>(
      std::count_if(fan_count.begin(), fan_count.end(), [](std::uint32_t n) { return n > 1; }));
}

}  // namespace

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
  const std::vector<Edge> edges = sorted_edges(mesh);
  std::size_t edge_count = 0;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high)
      ++end;
    ++edge_count;
    if (end - i != 2)
      ++report.open_edges;
    else if (edges[i].forward == edges[i + 1].forward)
      ++report.flipped_edges;
    i = end;
  }
  report.pinched_vertices = count_pinched(mesh, edges);
  DisjointSets component_sets(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    component_sets.join(t.v[0], t.v[1]);
    component_sets.join(t.v[0], t.v[2]);
    const Vec3 a = mesh.positions[t.v[0]], b = mesh.positions[t.v[1]], c = mesh.positions[t.v[2]];
    const float doubled_area = length(cross(b - a, c - a));
    report.area += 0.5 * doubled_area;
    if (doubled_area <= 0) ++report.degenerate_triangles;
  }
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v)
    if (component_sets.find(v) == v) ++report.components;
  report.euler = static_cast<long long>(report.vertices) - static_cast<long long>(edge_count) +
                 static_cast<long long>(report.triangles);
  report.genus = static_cast<long long>(report.components) - report.euler / 2;
  return report;
}

}  // namespace polymorph
