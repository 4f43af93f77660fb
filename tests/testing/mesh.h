// Mesh assertions that every extracted surface must satisfy; their messages say where it does not.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "kernels/mesh.h"

namespace polymorph {

struct Double3 {
  double x, y, z;
};
inline Double3 to_double(Vec3 a) { return {a.x, a.y, a.z}; }
inline Double3 minus(Double3 a, Double3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Double3 cross_of(Double3 a, Double3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double dot_of(Double3 a, Double3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length_of(Double3 a) { return std::sqrt(dot_of(a, a)); }

/// Returns a triangle's normal times twice the triangle's area.
inline Double3 area_vector(const Mesh& mesh, const Triangle& t) {
  const Double3 a = to_double(mesh.positions[t.v[0]]);
  return cross_of(minus(to_double(mesh.positions[t.v[1]]), a),
                  minus(to_double(mesh.positions[t.v[2]]), a));
}

inline double area_of(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += length_of(area_vector(mesh, t)) / 2;
  return sum;
}

inline double volume_of(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    sum += dot_of(to_double(mesh.positions[t.v[0]]), area_vector(mesh, t)) / 6;
  }
  return sum;
}

/// Returns vertices - edges + faces of a closed mesh, which has 3/2 edges per face.
inline std::int64_t euler_of(const Mesh& mesh) {
  return static_cast<std::int64_t>(mesh.positions.size()) -
         static_cast<std::int64_t>(mesh.triangles.size()) / 2;
}

/// Expects each directed edge once and its reverse once: the mesh is closed and consistently
/// oriented.
inline void expect_closed(const Mesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_LT(t.v[k], mesh.positions.size());
      edges.emplace_back(t.v[k], t.v[(k + 1) % 3]);
    }
  }
  std::sort(edges.begin(), edges.end());
  ASSERT_TRUE(std::adjacent_find(edges.begin(), edges.end()) == edges.end())
      << "an edge runs twice one way";
  for (const auto& edge : edges) {
    ASSERT_TRUE(
        std::binary_search(edges.begin(), edges.end(), std::make_pair(edge.second, edge.first)))
        << "open edge " << edge.first << "-" << edge.second;
  }
}

/// Expects that the triangles around each vertex form one fan, and that each vertex has triangles.
inline void expect_single_fans(const Mesh& mesh) {
  // around[v][a] = b for each triangle (v, a, b)
  std::vector<std::map<std::uint32_t, std::uint32_t>> around(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) around[t.v[k]][t.v[(k + 1) % 3]] = t.v[(k + 2) % 3];
  }
  for (std::size_t v = 0; v < around.size(); ++v) {
    ASSERT_FALSE(around[v].empty()) << "vertex " << v << " is in no triangle";
    const std::uint32_t start = around[v].begin()->first;
    std::uint32_t at = start;
    std::size_t steps = 0;
    do {
      const auto next = around[v].find(at);
      ASSERT_TRUE(next != around[v].end()) << "open fan at vertex " << v;
      at = next->second;
      ++steps;
    } while (at != start && steps <= around[v].size());
    ASSERT_EQ(steps, around[v].size()) << "several fans at vertex " << v;
  }
}

inline void expect_distinct_vertices(const Mesh& mesh) {
  std::vector<std::array<float, 3>> all;
  for (const Vec3 p : mesh.positions) all.push_back({p.x, p.y, p.z});
  std::sort(all.begin(), all.end());
  const auto twin = std::adjacent_find(all.begin(), all.end());
  ASSERT_TRUE(twin == all.end()) << "two vertices at " << (*twin)[0] << " " << (*twin)[1] << " "
                                 << (*twin)[2];
}

inline void expect_real_triangles(const Mesh& mesh) {
  for (const Triangle& t : mesh.triangles) ASSERT_GT(length_of(area_vector(mesh, t)), 0.0);
}

inline void expect_unit_normals(const Mesh& mesh) {
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  for (const Vec3 n : mesh.normals) ASSERT_NEAR(length_of(to_double(n)), 1.0, 1e-6);
}

/// Expects all of the above, and outward orientation.
inline void expect_sound(const Mesh& mesh) {
  ASSERT_FALSE(mesh.triangles.empty());
  ASSERT_NO_FATAL_FAILURE(expect_closed(mesh));
  ASSERT_NO_FATAL_FAILURE(expect_single_fans(mesh));
  ASSERT_NO_FATAL_FAILURE(expect_distinct_vertices(mesh));
  ASSERT_NO_FATAL_FAILURE(expect_real_triangles(mesh));
  ASSERT_NO_FATAL_FAILURE(expect_unit_normals(mesh));
  ASSERT_GT(volume_of(mesh), 0.0);
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

inline void expect_same_mesh(const Mesh& a, const Mesh& b) {
  ASSERT_EQ(a.positions.size(), b.positions.size());
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  EXPECT_TRUE(same_bits(a.positions, b.positions)) << "positions differ";
  EXPECT_TRUE(same_bits(a.normals, b.normals)) << "normals differ";
  EXPECT_TRUE(same_bits(a.triangles, b.triangles)) << "triangles differ";
}

}  // namespace polymorph
