#include "mesh/vertex_clustering.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr double kLong = 1.0 / 64;  // fraction of the diagonal
// Meshes with more than kManyLong long triangles are clustered. If as many remain, they are
// scattered and are thinned out to about kMaxScattered. Of nested shells, at most kMaxNested should
// remain.
constexpr std::size_t kManyLong = 16384, kMaxScattered = 2048, kMaxNested = 1024;
constexpr double kFineCells = 2048, kCoarseCells = 256;  // cells along the diagonal

bool is_long(MeshView mesh, const Triangle& t, double diagonal) {
  const Vec3d a(mesh.points[t.v[0]]), b(mesh.points[t.v[1]]), c(mesh.points[t.v[2]]);
  return std::max({length(b - a), length(c - b), length(a - c)}) > kLong * diagonal;
}

std::size_t count_long(MeshView mesh, double diagonal) {
  return static_cast<std::size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(),
                    [&](const Triangle& t) { return is_long(mesh, t, diagonal); }));
}

/// Finds, for each point, the first point in the same cell.
std::vector<std::uint32_t> first_points_in_cells(MeshView mesh, double cell) {
  const Vec3d low(mesh.box().low);
  std::unordered_map<std::uint64_t, std::uint32_t> first_in_cell;
  std::vector<std::uint32_t> representative(mesh.points.size());
  for (std::uint32_t i = 0; i < representative.size(); ++i) {
    const Vec3d cell_position = (Vec3d(mesh.points[i]) - low) * (1 / cell);
    // There are at most 2048 cells along an axis, and 20 bits for each index.
    const std::uint64_t key = static_cast<std::uint64_t>(cell_position.x) << 40 |
                              static_cast<std::uint64_t>(cell_position.y) << 20 |
                              static_cast<std::uint64_t>(cell_position.z);
    representative[i] = first_in_cell.try_emplace(key, i).first->second;
  }
  return representative;
}

/// Moves each point to the first point in its cell, and merges the triangles that then coincide.
ClusteredMesh cluster(MeshView mesh, double cell) {
  const std::vector<std::uint32_t> representative = first_points_in_cells(mesh, cell);
  struct OrientedCorners {
    std::array<std::uint32_t, 3> corners;  // ascending
    int signed_count = 1;                  // occurrences, minus those of the reversed triangle
  };
  std::vector<OrientedCorners> keyed_triangles;
  for (const Triangle& t : mesh.triangles) {
    std::array<std::uint32_t, 3> c{representative[t.v[0]], representative[t.v[1]],
                                   representative[t.v[2]]};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    // The lowest corner comes first; a rotation keeps the orientation.
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    const bool reverse = c[1] > c[2];  // sorting then reverses the orientation
    if (reverse) std::swap(c[1], c[2]);
    keyed_triangles.push_back({c, reverse ? -1 : 1});
  }
  std::sort(
      keyed_triangles.begin(), keyed_triangles.end(),
      [](const OrientedCorners& a, const OrientedCorners& b) { return a.corners < b.corners; });
  ClusteredMesh result;
  result.mesh.positions.assign(mesh.points.begin(), mesh.points.end());
  for (std::size_t i = 0; i < keyed_triangles.size();) {
    const std::array<std::uint32_t, 3> c = keyed_triangles[i].corners;
    int signed_count = 0;
    for (; i < keyed_triangles.size() && keyed_triangles[i].corners == c; ++i)
      signed_count += keyed_triangles[i].signed_count;
    if (signed_count == 0) continue;
    result.mesh.triangles.push_back(signed_count > 0 ? Triangle{{c[0], c[1], c[2]}}
                                                     : Triangle{{c[0], c[2], c[1]}});
    result.multiplicity.push_back(std::abs(signed_count));
  }
  return result;
}

/// Lists all short triangles and, of the long ones whose corners lie in the same cells, one.
/// Returns nothing if the list has half of the triangles or more. A long triangle with two corners
/// in one cell counts as an edge, and is left out if a listed triangle has that edge.
std::vector<std::uint32_t> list_one_per_cell_set(MeshView mesh, double cell, double diagonal) {
  const std::vector<std::uint32_t> representative = first_points_in_cells(mesh, cell);
  struct Cells {
    std::array<std::uint32_t, 3> cells;  // ascending; of two cells, the higher one twice
    std::uint32_t triangle;
    bool operator<(const Cells& other) const {
      return std::tie(cells, triangle) < std::tie(other.cells, other.triangle);
    }
  };
  std::vector<Cells> faces, edges;
  std::vector<std::uint32_t> listed;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (!is_long(mesh, t, diagonal)) {
      listed.push_back(i);
      continue;
    }
    std::array<std::uint32_t, 3> c{representative[t.v[0]], representative[t.v[1]],
                                   representative[t.v[2]]};
    std::sort(c.begin(), c.end());
    const bool is_edge = c[0] == c[1] || c[1] == c[2];
    (is_edge ? edges : faces).push_back({{c[0], is_edge ? c[2] : c[1], c[2]}, i});
  }
  const auto is_same = [](const Cells& a, const Cells& b) { return a.cells == b.cells; };
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end(), is_same), faces.end());
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end(), is_same), edges.end());
  std::unordered_set<std::uint64_t> edges_of_faces;
  const auto key = [](std::uint32_t low, std::uint32_t high) {
    return std::uint64_t{low} << 32 | high;
  };
  for (const auto& [c, triangle] : faces) {
    listed.push_back(triangle);
    edges_of_faces.insert({key(c[0], c[1]), key(c[1], c[2]), key(c[0], c[2])});
  }
  for (const auto& [c, triangle] : edges)
    if (!edges_of_faces.contains(key(c[0], c[2]))) listed.push_back(triangle);
  if (2 * listed.size() >= mesh.triangles.size()) return {};
  std::sort(listed.begin(), listed.end());
  return listed;
}

/// Copies the mesh unchanged, with multiplicities of 1.
ClusteredMesh copy_mesh(MeshView mesh) {
  ClusteredMesh copy;
  copy.mesh.positions.assign(mesh.points.begin(), mesh.points.end());
  copy.mesh.triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
  copy.multiplicity.assign(mesh.triangles.size(), 1);
  return copy;
}

/// Keeps every n-th long triangle and multiplies its multiplicity by n, so that few remain.
void thin_out(ClusteredMesh& clustered, std::size_t count, double diagonal) {
  const std::size_t n = (count + kMaxScattered - 1) / kMaxScattered;
  ClusteredMesh thinned;
  std::size_t long_count = 0;
  for (std::size_t i = 0; i < clustered.multiplicity.size(); ++i) {
    const Triangle& t = clustered.mesh.triangles[i];
    const bool is_long_triangle = is_long(clustered.mesh, t, diagonal);
    if (is_long_triangle && long_count++ % n != 0) continue;
    thinned.mesh.triangles.push_back(t);
    thinned.multiplicity.push_back(clustered.multiplicity[i] *
                                   (is_long_triangle ? static_cast<int>(n) : 1));
  }
  clustered.mesh.triangles = std::move(thinned.mesh.triangles);
  clustered.multiplicity = std::move(thinned.multiplicity);
  clustered.thinned = true;
}

}  // namespace

std::size_t count_long_triangles(MeshView mesh) {
  return count_long(mesh, static_cast<double>(mesh.box().diagonal()));
}

bool has_many_long_triangles(std::size_t count) { return count > kManyLong; }

std::optional<ClusteredMesh> cluster_long_triangles(MeshView mesh) {
  if (mesh.triangles.size() <= kManyLong) return std::nullopt;
  const double diagonal = static_cast<double>(mesh.box().diagonal());
  if (count_long(mesh, diagonal) <= kManyLong) return std::nullopt;
  for (double cells = kFineCells;; cells /= 2) {
    ClusteredMesh result = cluster(mesh, diagonal / cells);
    if (result.mesh.triangles.empty()) result = copy_mesh(mesh);  // walls thinner than a cell
    const std::size_t count = count_long(result.mesh, diagonal);
    // A mean multiplicity above 4 means nested shells. Their number matters more than their exact
    // positions, so coarser cells are tried.
    const long long multiplicity_sum =
        std::accumulate(result.multiplicity.begin(), result.multiplicity.end(), 0LL);
    const bool is_nested =
        multiplicity_sum > 4 * static_cast<long long>(result.multiplicity.size());
    if (count > (is_nested ? kMaxNested : kManyLong) && cells > kCoarseCells) continue;
    if (count > kManyLong) thin_out(result, count, diagonal);
    result.cell = diagonal / cells;
    return result;
  }
}

std::vector<std::uint32_t> list_representative_triangles(MeshView mesh) {
  const std::optional<ClusteredMesh> clustered = cluster_long_triangles(mesh);
  if (!clustered) return {};
  const double diagonal = static_cast<double>(mesh.box().diagonal());
  if (!clustered->thinned) return list_one_per_cell_set(mesh, clustered->cell, diagonal);
  std::vector<std::uint32_t> listed_triangles;
  const std::size_t n = (count_long(mesh, diagonal) + kMaxScattered - 1) / kMaxScattered;
  std::size_t long_count = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (!is_long(mesh, mesh.triangles[i], diagonal) || long_count++ % n == 0)
      listed_triangles.push_back(static_cast<std::uint32_t>(i));
  return listed_triangles;
}

}  // namespace polymorph
