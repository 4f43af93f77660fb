#include "surface/components.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace polymorph {
namespace {

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// A mesh's connected parts, each named by one of its vertices.
struct Parts {
  std::vector<std::uint32_t> parent;
  std::vector<double> volume;  ///< of the part with this root, times 6

  explicit Parts(const Mesh& mesh) : parent(mesh.positions.size()), volume(parent.size(), 0.0) {
    std::iota(parent.begin(), parent.end(), 0u);
    for (const Triangle& t : mesh.triangles)
      for (int k = 1; k < 3; ++k) {
        const std::uint32_t a = root_of(parent, t.v[0]), b = root_of(parent, t.v[k]);
        parent[std::max(a, b)] = std::min(a, b);
      }
    const Vec3 origin = mesh.positions[mesh.triangles[0].v[0]];
    for (const Triangle& t : mesh.triangles)
      volume[root_of(parent, t.v[0])] += static_cast<double>(
          dot(mesh.positions[t.v[0]] - origin,
              cross(mesh.positions[t.v[1]] - origin, mesh.positions[t.v[2]] - origin)));
  }
};

}  // namespace

double smallest_component_share(const Mesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  const Parts parts(mesh);
  double whole = 0, smallest = std::numeric_limits<double>::infinity();
  for (const double v : parts.volume) {
    whole += v;
    if (v != 0) smallest = std::min(smallest, std::abs(v));
  }
  return whole > 0 ? std::min(smallest / whole, 1.0) : 0;
}

std::size_t remove_small_components(Mesh& mesh, double share) {
  if (mesh.triangles.empty() || !(share > 0)) return 0;
  Parts parts(mesh);
  std::vector<std::uint32_t>& parent = parts.parent;
  const std::vector<double>& volume = parts.volume;
  double whole = 0, largest = 0;
  for (const double v : volume) whole += v, largest = std::max(largest, std::abs(v));
  const double least = std::min(share * whole, largest);
  std::vector<std::uint8_t> keep(parent.size(), 0);
  std::size_t dropped = 0;
  for (std::uint32_t i = 0; i < parent.size(); ++i) {
    const std::uint32_t root = root_of(parent, i);
    keep[i] = std::abs(volume[root]) >= least;
    dropped += root == i && !keep[i];
  }
  if (dropped == 0) return 0;
  std::vector<std::uint32_t> number(parent.size());
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < parent.size(); ++i) {
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
