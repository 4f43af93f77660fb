#include "mesh/components.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "base/disjoint_sets.h"

namespace polymorph {
namespace {

DisjointSets connect_vertices(const Mesh& mesh) {
  DisjointSets sets(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    sets.join(t.v[0], t.v[1]);
    sets.join(t.v[0], t.v[2]);
  }
  return sets;
}

/// A mesh's connected components, each represented by its first vertex.
struct Components {
  DisjointSets sets;
  /// Per vertex: six times the signed volume of the component whose first vertex it is; else 0.
  std::vector<double> volume;

  explicit Components(const Mesh& mesh)
      : sets(connect_vertices(mesh)), volume(mesh.positions.size(), 0.0) {
    const Vec3 origin = mesh.positions[mesh.triangles[0].v[0]];
    for (const Triangle& t : mesh.triangles)
      volume[sets.find(t.v[0])] += static_cast<double>(
          dot(mesh.positions[t.v[0]] - origin,
              cross(mesh.positions[t.v[1]] - origin, mesh.positions[t.v[2]] - origin)));
  }

  double total() const { return std::accumulate(volume.begin(), volume.end(), 0.0); }
  /// Fraction, in [0, 1], of the total volume that components below `fraction` of the total volume
  /// enclose together.
  double small_share(double fraction) const {
    const double total_volume = total();
    double small_volume = 0;
    for (const double v : volume)
      if (std::abs(v) < fraction * total_volume) small_volume += std::abs(v);
    return total_volume > 0 ? std::min(small_volume / total_volume, 1.0) : 0;
  }
};

}  // namespace

std::size_t count_components(const Mesh& mesh) {
  DisjointSets sets = connect_vertices(mesh);
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < sets.size(); ++v) count += sets.find(v) == v;
  return count;
}

double smallest_component_share(const Mesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  const Components components(mesh);
  const double total = components.total();
  double smallest = std::numeric_limits<double>::infinity();
  for (const double v : components.volume)
    if (v != 0) smallest = std::min(smallest, std::abs(v));
  return total > 0 ? std::min(smallest / total, 1.0) : 0;
}

std::size_t remove_small_components(Mesh& mesh, double fraction, ManyComponentsLimit limit) {
  if (mesh.triangles.empty() || !(fraction > 0)) return 0;
  Components components(mesh);
  const std::vector<double>& volume = components.volume;
  const double total = components.total();
  double largest = 0;
  for (const double v : volume) largest = std::max(largest, std::abs(v));
  if (components.small_share(fraction) > limit.share) fraction = limit.fraction;
  const double min_volume = std::min(fraction * total, largest);  // the largest always stays
  std::vector<std::uint8_t> is_kept(mesh.positions.size(), 0);
  std::size_t removed = 0;
  for (std::uint32_t i = 0; i < mesh.positions.size(); ++i) {
    const std::uint32_t root = components.sets.find(i);
    is_kept[i] = std::abs(volume[root]) >= min_volume;
    removed += root == i && !is_kept[i];
  }
  if (removed == 0) return 0;
  std::vector<std::uint32_t> new_index(mesh.positions.size());
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < is_kept.size(); ++i) {
    if (!is_kept[i]) continue;
    mesh.positions[count] = mesh.positions[i];
    if (!mesh.normals.empty()) mesh.normals[count] = mesh.normals[i];
    new_index[i] = count++;
  }
  mesh.positions.resize(count);
  if (!mesh.normals.empty()) mesh.normals.resize(count);
  std::erase_if(mesh.triangles, [&](const Triangle& t) { return !is_kept[t.v[0]]; });
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t.v) v = new_index[v];
  return removed;
}

}  // namespace polymorph
