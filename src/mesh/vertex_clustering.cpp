#include "mesh/vertex_clustering.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <unordered_map>
#include <vector>

#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr double kLong = 1.0 / 64;
constexpr std::size_t kManyLong = 16384, kFewStrewn = 2048, kFewNested = 1024;
constexpr double kFineCells = 2048, kCoarseCells = 256;  // along the diagonal

bool is_long(MeshView mesh, const Triangle& t, double diagonal) {
  const Vec3d a(mesh.points[t.v[0]]), b(mesh.points[t.v[1]]), c(mesh.points[t.v[2]]);
  return std::max({length(b - a), length(c - b), length(a - c)}) > kLong * diagonal;
}

std::size_t count_long(MeshView mesh, double diagonal) {
  return static_cast<std::size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(),
                    [&](const Triangle& t) { return is_long(mesh, t, diagonal); }));
}

ClusteredMesh cluster(MeshView mesh, double cell) {
  const Vec3d low(mesh.box().low);
  std::unordered_map<std::uint64_t, std::uint32_t> first_in_cell;
  std::vector<std::uint32_t> representative(mesh.points.size());
  for (std::uint32_t i = 0; i < representative.size(); ++i) {
    const Vec3d at = (Vec3d(mesh.points[i]) - low) * (1 / cell);
    const std::uint64_t key = static_cast<std::uint64_t>(at.x) << 40 |
                              static_cast<std::uint64_t>(at.y) << 20 |
                              static_cast<std::uint64_t>(at.z);
    representative[i] = first_in_cell.try_emplace(key, i).first->second;
  }
  struct Corners {
    std::array<std::uint32_t, 3> corners;  // ascending
    int times = 1;                         // occurrences, minus those of the reversed triangle
  };
  std::vector<Corners> all;
  for (const Triangle& t : mesh.triangles) {
    std::array<std::uint32_t, 3> c{representative[t.v[0]], representative[t.v[1]],
                                   representative[t.v[2]]};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    const bool reverse = c[1] > c[2];
    if (reverse) std::swap(c[1], c[2]);
    all.push_back({c, reverse ? -1 : 1});
  }
  std::sort(all.begin(), all.end(),
            [](const Corners& a, const Corners& b) { return a.corners < b.corners; });
  ClusteredMesh result;
  result.mesh.positions.assign(mesh.points.begin(), mesh.points.end());
  for (std::size_t i = 0; i < all.size();) {
    const std::array<std::uint32_t, 3> c = all[i].corners;
    int times = 0;
    for (; i < all.size() && all[i].corners == c; ++i) times += all[i].times;
    if (times == 0) continue;
    result.mesh.triangles.push_back(times > 0 ? Triangle{{c[0], c[1], c[2]}}
                                              : Triangle{{c[0], c[2], c[1]}});
    result.multiplicity.push_back(std::abs(times));
  }
  return result;
}

/// Copies the mesh unchanged.
ClusteredMesh copy_mesh(MeshView mesh) {
  ClusteredMesh copy;
  copy.mesh.positions.assign(mesh.points.begin(), mesh.points.end());
  copy.mesh.triangles.assign(mesh.triangles.begin(), mesh.triangles.end());
  copy.multiplicity.assign(mesh.triangles.size(), 1);
  return copy;
}

/// Keeps every n-th long triangle and multiplies its multiplicity by n, so that few remain.
void thin_out(ClusteredMesh& clustered, std::size_t count, double diagonal) {
  const std::size_t n = (count + kFewStrewn - 1) / kFewStrewn;
  ClusteredMesh thinned;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < clustered.multiplicity.size(); ++i) {
    const Triangle& t = clustered.mesh.triangles[i];
    const bool is_long_one = is_long(clustered.mesh, t, diagonal);
    if (is_long_one && seen++ % n != 0) continue;
    thinned.mesh.triangles.push_back(t);
    thinned.multiplicity.push_back(clustered.multiplicity[i] *
                                   (is_long_one ? static_cast<int>(n) : 1));
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
    // For nested shells their number matters more than the exact position of each.
    const long long times =
        std::accumulate(result.multiplicity.begin(), result.multiplicity.end(), 0LL);
    const bool nested = times > 4 * static_cast<long long>(result.multiplicity.size());
    if (count > (nested ? kFewNested : kManyLong) && cells > kCoarseCells) continue;
    if (count > kManyLong) thin_out(result, count, diagonal);
    return result;
  }
}

std::vector<std::uint32_t> thin_long_triangles(MeshView mesh) {
  const std::optional<ClusteredMesh> clustered = cluster_long_triangles(mesh);
  std::vector<std::uint32_t> kept_vertices;
  if (!clustered || !clustered->thinned) return kept_vertices;
  const double diagonal = static_cast<double>(mesh.box().diagonal());
  const std::size_t n = (count_long(mesh, diagonal) + kFewStrewn - 1) / kFewStrewn;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (!is_long(mesh, mesh.triangles[i], diagonal) || seen++ % n == 0)
      kept_vertices.push_back(static_cast<std::uint32_t>(i));
  return kept_vertices;
}

}  // namespace polymorph
