#include "mesh/carry/patch_map.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <unordered_map>

#include "base/exact_math.h"
#include "mesh/edges.h"

namespace polymorph {
namespace {

using Flags = std::vector<std::uint8_t>;
using Vec2d = Eigen::Vector2d;

/// Connected components of the triangles whose flag is `value`.
struct FlaggedComponents {
  std::vector<std::uint32_t> number;  ///< component per triangle, from 1; 0 if the flag differs
  std::vector<std::size_t> size;      ///< triangles per component; size[0] is unused
};
FlaggedComponents find_components(const std::vector<Triangle>& neighbours, const Flags& is_selected,
                                  std::uint8_t value) {
  FlaggedComponents components{std::vector<std::uint32_t>(is_selected.size(), 0), {0}};
  std::vector<std::uint32_t> stack;
  for (std::uint32_t f = 0; f < is_selected.size(); ++f) {
    if (is_selected[f] != value || components.number[f] != 0) continue;
    const auto component = static_cast<std::uint32_t>(components.size.size());
    components.size.push_back(0);
    stack.push_back(f);
    components.number[f] = component;
    while (!stack.empty()) {
      const std::uint32_t g = stack.back();
      stack.pop_back();
      ++components.size[component];
      for (const std::uint32_t n : neighbours[g].v)
        if (is_selected[n] == value && components.number[n] == 0)
          components.number[n] = component, stack.push_back(n);
    }
  }
  return components;
}

std::uint32_t find_largest(const FlaggedComponents& components) {
  return static_cast<std::uint32_t>(
      std::max_element(components.size.begin(), components.size.end()) - components.size.begin());
}

/// Adds `rings` rings of triangles to the selected ones.
void grow(std::span<const Triangle> triangles, std::size_t points, int rings, Flags& is_selected) {
  for (int r = 0; r < rings; ++r) {
    Flags is_touched(points, 0);
    for (std::size_t f = 0; f < is_selected.size(); ++f)
      if (is_selected[f])
        for (const std::uint32_t v : triangles[f].v) is_touched[v] = 1;
    for (std::size_t f = 0; f < is_selected.size(); ++f)
      if (!is_selected[f])
        is_selected[f] = is_touched[triangles[f].v[0]] || is_touched[triangles[f].v[1]] ||
                         is_touched[triangles[f].v[2]];
  }
}

/// A disk of triangles: its border's points in order, and all its points.
struct Disk {
  std::vector<std::uint32_t> faces, border, points;
  std::unordered_map<std::uint32_t, std::uint32_t> index;  ///< index in `points` per mesh point
};

/// Makes a disk of the selected triangles, which are connected, and fills its holes. Border points
/// come first. Returns nothing if the triangles form no disk.
std::optional<Disk> make_disk(std::span<const Triangle> triangles,
                              const std::vector<Triangle>& neighbours, std::size_t points,
                              Flags is_selected) {
  for (int attempt = 0; attempt < 8; ++attempt) {
    const FlaggedComponents outside = find_components(neighbours, is_selected, 0);
    if (outside.size.size() < 2) return std::nullopt;
    const std::uint32_t largest = find_largest(outside);
    for (std::size_t f = 0; f < is_selected.size(); ++f)
      if (!is_selected[f] && outside.number[f] != largest) is_selected[f] = 1;
    std::map<std::uint32_t, std::uint32_t> next;
    Flags is_pinched_point(points, 0);
    bool is_pinched = false;
    for (std::uint32_t f = 0; f < is_selected.size(); ++f) {
      if (!is_selected[f]) continue;
      for (int k = 0; k < 3; ++k) {
        if (is_selected[neighbours[f].v[k]]) continue;
        const auto [entry, is_new] = next.emplace(triangles[f].v[k], triangles[f].v[(k + 1) % 3]);
        if (!is_new) is_pinched_point[triangles[f].v[k]] = 1, is_pinched = true;
      }
    }
    if (is_pinched) {  // widen the disk where its border touches itself, and try again
      for (std::size_t f = 0; f < is_selected.size(); ++f)
        for (const std::uint32_t v : triangles[f].v) is_selected[f] |= is_pinched_point[v];
      continue;
    }
    if (next.empty()) return std::nullopt;
    Disk disk;
    const std::uint32_t first = next.begin()->first;
    std::uint32_t v = first;
    do {
      disk.border.push_back(v);
      v = next.at(v);
    } while (v != first && disk.border.size() <= next.size());
    if (disk.border.size() != next.size()) return std::nullopt;  // more than one border
    disk.points = disk.border;
    for (std::uint32_t i = 0; i < disk.border.size(); ++i) disk.index[disk.border[i]] = i;
    for (std::uint32_t f = 0; f < is_selected.size(); ++f) {
      if (!is_selected[f]) continue;
      disk.faces.push_back(f);
      for (const std::uint32_t p : triangles[f].v)
        if (disk.index.emplace(p, static_cast<std::uint32_t>(disk.points.size())).second)
          disk.points.push_back(p);
    }
    // V - E + F = 1 for a disk; E = (3 F + border) / 2.
    const auto euler = static_cast<long long>(2 * disk.points.size() + 2 * disk.faces.size()) -
                       static_cast<long long>(3 * disk.faces.size() + disk.border.size());
    if (euler != 2) return std::nullopt;
    return disk;
  }
  return std::nullopt;
}

/// Places the inner points of a disk in the plane, each at the weighted mean of its neighbours.
/// `planar` holds the border's positions; `weight(p, q, r)` is the share of triangle pqr in the
/// weight of p's neighbour q. Returns false if the system is singular.
template <class Weight>
bool embed(const Disk& disk, std::span<const Triangle> triangles, std::vector<Vec2d>& planar,
           const Weight& weight) {
  const auto border = disk.border.size();
  const auto inner = static_cast<Eigen::Index>(disk.points.size() - border);
  planar.resize(disk.points.size());
  if (inner == 0) return true;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX2d right_side = Eigen::MatrixX2d::Zero(inner, 2);
  std::vector<double> sums(static_cast<std::size_t>(inner), 0.0);
  for (const std::uint32_t f : disk.faces)
    for (int k = 0; k < 3; ++k)
      for (const int step : {1, 2}) {
        const std::uint32_t p = triangles[f].v[k], q = triangles[f].v[(k + step) % 3],
                            r = triangles[f].v[(k + 3 - step) % 3];
        const std::uint32_t i = disk.index.at(p), j = disk.index.at(q);
        if (i < border) continue;
        const double w = weight(p, q, r);
        const auto row = static_cast<Eigen::Index>(i - border);
        sums[i - border] += w;
        if (j < border)
          right_side.row(row) += w * planar[j].transpose();
        else
          entries.emplace_back(row, static_cast<Eigen::Index>(j - border), -w);
      }
  for (Eigen::Index i = 0; i < inner; ++i)
    entries.emplace_back(i, i, sums[static_cast<std::size_t>(i)]);
  Eigen::SparseMatrix<double> matrix(inner, inner);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> solver;
  solver.compute(matrix);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::MatrixX2d x = solver.solve(right_side);
  for (Eigen::Index i = 0; i < inner; ++i) planar[border + static_cast<std::size_t>(i)] = x.row(i);
  return true;
}

/// A position in a disk: barycentric weights in one of its faces.
struct DiskPosition {
  std::uint32_t face = 0;
  double weights[3] = {1, 0, 0};
};

/// Finds the face of the flattened disk that contains a point or, if none does, the face in which
/// its smallest barycentric coordinate is largest.
DiskPosition locate(const Disk& disk, std::span<const Triangle> triangles,
                    const std::vector<Vec2d>& planar, Vec2d p) {
  DiskPosition best;
  double max_inside = -1e300;
  for (const std::uint32_t f : disk.faces) {
    const Triangle& t = triangles[f];
    const Vec2d a = planar[disk.index.at(t.v[0])], b = planar[disk.index.at(t.v[1])] - a,
                c = planar[disk.index.at(t.v[2])] - a, d = p - a;
    const double area = b.x() * c.y() - b.y() * c.x();
    if (!(std::abs(area) > 0)) continue;
    const double u = (d.x() * c.y() - d.y() * c.x()) / area,
                 v = (b.x() * d.y() - b.y() * d.x()) / area;
    const double inside = std::min({1 - u - v, u, v});
    if (inside > max_inside) {
      max_inside = inside;
      best = {f, {1 - u - v, u, v}};
      if (inside >= 0) break;
    }
  }
  for (double& w : best.weights) w = std::max(w, 0.0);
  const double sum = best.weights[0] + best.weights[1] + best.weights[2];
  for (double& w : best.weights) w /= sum;
  return best;
}

/// Maps one patch onto a disk of the target's surface. Returns false if that is impossible.
bool map_patch(std::vector<Vec3>& points, std::span<const Triangle> triangles, const Disk& patch,
               const CarryTarget& target, const Disk& target_disk) {
  const Mesh& surface = target.surface;
  // Map the border of the target's disk to the unit circle, by arc length.
  std::vector<Vec2d> planar(target_disk.points.size());
  double total = 0;
  std::vector<double> arc_length;
  for (std::size_t i = 0; i < target_disk.border.size(); ++i) {
    arc_length.push_back(total);
    total += static_cast<double>(
        length(surface.positions[target_disk.border[(i + 1) % target_disk.border.size()]] -
               surface.positions[target_disk.border[i]]));
  }
  for (std::size_t i = 0; i < target_disk.border.size(); ++i) {
    const double angle = 2 * 3.14159265358979 * arc_length[i] / total;
    planar[i] = {exact::cos(angle), exact::sin(angle)};
  }
  // Tangent of half the angle between two vectors, limited where they are nearly parallel.
  const auto tan_half = [&](Vec3 a, Vec3 b) {
    const double c = static_cast<double>(dot(a, b)), s = static_cast<double>(length(cross(a, b)));
    const double norm = std::sqrt(c * c + s * s);
    return s > 1e-12 * norm ? (norm - c) / s : (c > 0 ? 1e-6 : 1e6);
  };
  const bool is_embedded = embed(target_disk, surface.triangles, planar,
                                 [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
                                   const Vec3 a = surface.positions[q] - surface.positions[p],
                                              b = surface.positions[r] - surface.positions[p];
                                   const auto edge_length =
                                       std::max(static_cast<double>(length(a)), 1e-12);
                                   return std::clamp(tan_half(a, b), 1e-3, 1e3) / edge_length;
                                 });
  if (!is_embedded) return false;
  Flags in_target_disk(surface.triangles.size(), 0);
  for (const std::uint32_t f : target_disk.faces) in_target_disk[f] = 1;
  std::vector<Vec2d> planar_patch(patch.points.size());
  for (std::size_t i = 0; i < patch.border.size(); ++i) {
    const ClosestPoint hit = target.tree->closest(points[patch.border[i]]);
    if (!in_target_disk[hit.triangle]) return false;
    const Triangle& t = surface.triangles[hit.triangle];
    const TriangleWeights w = weights_at(surface, hit);
    planar_patch[i] = planar[target_disk.index.at(t.v[0])] * w.a +
                      planar[target_disk.index.at(t.v[1])] * w.b +
                      planar[target_disk.index.at(t.v[2])] * w.c;
  }
  if (!embed(patch, triangles, planar_patch,
             [](std::uint32_t, std::uint32_t, std::uint32_t) { return 1.0; }))
    return false;
  for (std::size_t i = patch.border.size(); i < planar_patch.size(); ++i) {
    const DiskPosition at = locate(target_disk, surface.triangles, planar, planar_patch[i]);
    const Triangle& t = surface.triangles[at.face];
    Vec3 p;
    for (int k = 0; k < 3; ++k)
      p = p + surface.positions[t.v[k]] * static_cast<float>(at.weights[k]);
    points[patch.points[i]] = p;
  }
  return true;
}

}  // namespace

std::size_t map_patches(std::vector<Vec3>& points, std::span<const Triangle> triangles,
                        const PatchSeeds& seeds, const CarryTarget& target,
                        std::span<const std::uint32_t> mesh_near) {
  const Mesh& surface = target.surface;
  const std::vector<Triangle> neighbours = find_neighbours(triangles),
                              target_neighbours = find_neighbours(surface.triangles);
  Flags is_near_seed(triangles.size(), 0);
  for (const std::uint32_t f : seeds.triangles) is_near_seed[f] = 1;
  grow(triangles, points.size(), seeds.rings, is_near_seed);
  const FlaggedComponents patches = find_components(neighbours, is_near_seed, 1);
  std::size_t mapped_count = 0;
  for (std::uint32_t component = 1; component < patches.size.size(); ++component) {
    Flags is_selected(triangles.size(), 0);
    for (std::size_t f = 0; f < is_selected.size(); ++f)
      is_selected[f] = patches.number[f] == component;
    const std::optional<Disk> patch = make_disk(triangles, neighbours, points.size(), is_selected);
    if (!patch) continue;
    for (const std::uint32_t f : patch->faces) is_selected[f] = 1;
    // A wider region, so that the target's disk contains the whole patch.
    grow(triangles, points.size(), 4, is_selected);
    Flags is_target(surface.triangles.size(), 0);
    for (std::size_t f = 0; f < is_target.size(); ++f)
      is_target[f] = is_selected[mesh_near[surface.triangles[f].v[0]]];
    const FlaggedComponents target_components = find_components(target_neighbours, is_target, 1);
    if (target_components.size.size() < 2) continue;
    const std::uint32_t largest = find_largest(target_components);
    for (std::size_t f = 0; f < is_target.size(); ++f)
      is_target[f] = target_components.number[f] == largest;
    const std::optional<Disk> target_disk =
        make_disk(surface.triangles, target_neighbours, surface.positions.size(), is_target);
    if (!target_disk) continue;
    mapped_count += map_patch(points, triangles, *patch, target, *target_disk);
  }
  return mapped_count;
}

}  // namespace polymorph
