#include "mesh/components.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "base/disjoint_sets.h"

namespace polymorph {
namespace {

/// A mesh's connected components, each represented by its first vertex.
struct Components {
  DisjointSets sets;
  std::vector<double> volume;  ///< of the component that this vertex represents, times 6

  explicit Components(const Mesh& mesh)
      : sets(mesh.positions.size()), volume(mesh.positions.size(), 0.0) {
    for (const Triangle& t : mesh.triangles) {
      sets.join(t.v[0], t.v[1]);
      sets.join(t.v[0], t.v[2]);
    }
    const Vec3 origin = mesh.positions[mesh.triangles[0].v[0]];
    for (const Triangle& t : mesh.triangles)
      volume[sets.find(t.v[0])] += static_cast<double>(
          dot(mesh.positions[t.v[0]] - origin,
              cross(mesh.positions[t.v[1]] - origin, mesh.positions[t.v[2]] - origin)));
  }
};

}  // namespace

double smallest_component_share(const Mesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  const Components components(mesh);
  double whole = 0, smallest = std::numeric_limits<double>::infinity();
  for (const double v : components.volume) {
    whole += v;
    if (v != 0) smallest = std::min(smallest, std::abs(v));
  }
  return whole > 0 ? std::min(smallest / whole, 1.0) : 0;
}

std::size_t remove_small_components(Mesh& mesh, double share) {
  if (mesh.triangles.empty() || !(share > 0)) return 0;
  Components components(mesh);
  const std::vector<double>& volume = components.volume;
  double whole = 0, largest = 0;
  for (const double v : volume) whole += v, largest = std::max(largest, std::abs(v));
  const double min_volume = std::min(share * whole, largest);
  std::vector<std::uint8_t> keep(mesh.positions.size(), 0);
  std::size_t dropped = 0;
  for (std::uint32_t i = 0; i < mesh.positions.size(); ++i) {
    const std::uint32_t root = components.sets.find(i);
    keep[i] = std::abs(volume[root]) >= min_volume;
    dropped += root == i && !keep[i];
  }
  if (dropped == 0) return 0;
  std::vector<std::uint32_t> number(mesh.positions.size());
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) continue;
    mesh.positions[count] = mesh.positions[i];
    if (!mesh.normals.empty()) mesh.normals[count] = mesh.normals[i];
    number[i] = count++;
  }
  mesh.positions.resize(count);
  if (!mesh.normals.empty()) mesh.normals.resize(count);
  std::erase_if(mesh.triangles, [&](const Triangle& t) { return !keep[t.v[0]]; });
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t.v) v = number[v];
  return dropped;
}

}  // namespace polymorph
