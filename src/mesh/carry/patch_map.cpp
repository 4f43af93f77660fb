#include "mesh/carry/patch_map.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <map>
#include <numeric>
#include <optional>

#include "base/exact_math.h"
#include "mesh/carry/divide.h"

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
  std::vector<std::uint32_t> index;  ///< per mesh point: its index in `points`, or kOutside
  static constexpr std::uint32_t kOutside = 0xffffffffu;
};

/// Makes a disk of the selected triangles, which are connected, and fills its holes. Border points
/// come first. Returns nothing if the triangles form no disk.
std::optional<Disk> make_disk(std::span<const Triangle> triangles,
                              const std::vector<Triangle>& neighbours, std::size_t points,
                              Flags is_selected) {
  for (int attempt = 0; attempt < 8; ++attempt) {
    // Fill the holes: all of the outside except its largest component.
    const FlaggedComponents outside = find_components(neighbours, is_selected, /*value=*/0);
    if (outside.size.size() < 2) return std::nullopt;
    const std::uint32_t largest = find_largest(outside);
    for (std::size_t f = 0; f < is_selected.size(); ++f)
      if (!is_selected[f] && outside.number[f] != largest) is_selected[f] = 1;
    // Chain the sides of the border: `next` leads from each of its points to the next one.
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
    // Number the points.
    disk.points = disk.border;
    disk.index.assign(points, Disk::kOutside);
    for (std::uint32_t i = 0; i < disk.border.size(); ++i) disk.index[disk.border[i]] = i;
    for (std::uint32_t f = 0; f < is_selected.size(); ++f) {
      if (!is_selected[f]) continue;
      disk.faces.push_back(f);
      for (const std::uint32_t p : triangles[f].v)
        if (disk.index[p] == Disk::kOutside) {
          disk.index[p] = static_cast<std::uint32_t>(disk.points.size());
          disk.points.push_back(p);
        }
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
/// `planar` holds the border's positions; `weight(p, q, r)` is what triangle pqr adds to the weight
/// of p's neighbour q. Returns false if the linear system is singular.
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
        const std::uint32_t i = disk.index[p], j = disk.index[q];
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

/// A flattened disk of the target's surface.
struct FlatDisk {
  const Mesh& surface;
  const std::vector<Triangle>& neighbours;  ///< per triangle of the surface: those across its sides
  Disk disk;
  Flags is_inside = {};            ///< per triangle of the surface: 1 if it belongs to the disk
  std::vector<Vec2d> planar = {};  ///< per point of the disk
};

/// Barycentric coordinates of a point in the plane. Returns false if the face has no area.
bool coordinates_in(const FlatDisk& flat, std::uint32_t face, Vec2d p, double (&weights)[3]) {
  const Triangle& t = flat.surface.triangles[face];
  const Vec2d a = flat.planar[flat.disk.index[t.v[0]]],
              b = flat.planar[flat.disk.index[t.v[1]]] - a,
              c = flat.planar[flat.disk.index[t.v[2]]] - a, d = p - a;
  const double area = b.x() * c.y() - b.y() * c.x();
  if (!(std::abs(area) > 0)) return false;
  weights[1] = (d.x() * c.y() - d.y() * c.x()) / area;
  weights[2] = (b.x() * d.y() - b.y() * d.x()) / area;
  weights[0] = 1 - weights[1] - weights[2];
  return true;
}

/// Finds the face of the flattened disk that contains a point or, if none does, the face in which
/// its smallest barycentric coordinate is largest. Walks from the face `start` towards the point
/// (Devillers, Pion and Teillaud 2002); where that fails, looks at all faces.
DiskPosition locate(const FlatDisk& flat, Vec2d p, std::uint32_t start) {
  DiskPosition best{start, {1, 0, 0}};
  double weights[3];
  std::uint32_t face = start;
  bool is_found = false;
  for (std::size_t step = 0; step < 64 + flat.disk.faces.size() / 4; ++step) {
    if (!coordinates_in(flat, face, p, weights)) break;
    const int k = static_cast<int>(std::min_element(weights, weights + 3) - weights);
    if (weights[k] >= 0) {
      best = {face, {weights[0], weights[1], weights[2]}};
      is_found = true;
      break;
    }
    // Corner k lies opposite to the side from corner k + 1 to k + 2.
    const std::uint32_t next = flat.neighbours[face].v[(k + 1) % 3];
    if (!flat.is_inside[next]) break;
    face = next;
  }
  if (!is_found) {
    double max_inside = -1e300;  // below all coordinates
    for (const std::uint32_t f : flat.disk.faces) {
      if (!coordinates_in(flat, f, p, weights)) continue;
      const double inside = *std::min_element(weights, weights + 3);
      if (inside <= max_inside) continue;
      max_inside = inside;
      best = {f, {weights[0], weights[1], weights[2]}};
      if (inside >= 0) break;
    }
  }
  for (double& w : best.weights) w = std::max(w, 0.0);
  const double sum = best.weights[0] + best.weights[1] + best.weights[2];
  for (double& w : best.weights) w /= sum;
  return best;
}

/// A patch of the mesh in the plane of a flattened disk.
struct FlatPatch {
  Disk disk;
  std::vector<Vec2d> planar;         ///< per point of the patch
  std::vector<std::uint32_t> faces;  ///< per point of the patch: the flattened disk's face there
};

Vec3 point_at(const FlatDisk& flat, const DiskPosition& at) {
  const Triangle& t = flat.surface.triangles[at.face];
  Vec3 p;
  for (int k = 0; k < 3; ++k)
    p = p + flat.surface.positions[t.v[k]] * static_cast<float>(at.weights[k]);
  return p;
}

/// Returns the position on the surface of point `i` of a patch, and sets its face. `start`: a face
/// near it.
Vec3 place_on_disk(const FlatDisk& flat, FlatPatch& patch, std::size_t i, std::uint32_t start) {
  const DiskPosition at = locate(flat, patch.planar[i], start);
  patch.faces[i] = at.face;
  return point_at(flat, at);
}

/// Shape of a triangle in the plane: 1 / (2 sqrt 3) if equilateral, negative if clockwise.
double planar_quality(Vec2d a, Vec2d b, Vec2d c) {
  const Vec2d ab = b - a, ac = c - a, bc = c - b;
  const double edges = ab.squaredNorm() + ac.squaredNorm() + bc.squaredNorm();
  return edges > 0 ? (ab.x() * ac.y() - ab.y() * ac.x()) / edges : 0.0;
}

/// Moves inner points of a patch in the plane until no triangle is folded over. Returns false if
/// some stay folded.
bool untangle(FlatPatch& patch, std::span<const Triangle> triangles) {
  constexpr int kMaxSweeps = 60;
  constexpr double kMinQuality2d = 1e-3,
                   kDirections[8][2] = {{1, 0},   {0, 1},    {-1, 0},    {0, -1},
                                        {.7, .7}, {-.7, .7}, {-.7, -.7}, {.7, -.7}};
  std::vector<Vec2d>& planar = patch.planar;
  const Disk& disk = patch.disk;
  std::vector<std::vector<std::uint32_t>> fans(planar.size());
  for (const std::uint32_t f : disk.faces)
    for (const std::uint32_t v : triangles[f].v) fans[disk.index[v]].push_back(f);
  const auto quality = [&](std::uint32_t f) {
    const auto& v = triangles[f].v;
    return planar_quality(planar[disk.index[v[0]]], planar[disk.index[v[1]]],
                          planar[disk.index[v[2]]]);
  };
  const auto min_quality = [&](std::size_t i) {
    double result = 1;
    for (const std::uint32_t f : fans[i]) result = std::min(result, quality(f));
    return result;
  };
  for (int sweep = 0;; ++sweep) {
    std::vector<std::uint32_t> folded_points;
    for (const std::uint32_t f : disk.faces)
      if (quality(f) < kMinQuality2d)
        for (const std::uint32_t v : triangles[f].v)
          if (disk.index[v] >= disk.border.size()) folded_points.push_back(disk.index[v]);
    std::sort(folded_points.begin(), folded_points.end());
    folded_points.erase(std::unique(folded_points.begin(), folded_points.end()),
                        folded_points.end());
    if (folded_points.empty() || sweep == kMaxSweeps) break;
    for (const std::uint32_t i : folded_points) {
      double radius = 0, best = min_quality(i);
      for (const std::uint32_t f : fans[i])
        for (const std::uint32_t v : triangles[f].v)
          radius = std::max(radius, (planar[disk.index[v]] - planar[i]).norm());
      for (double step = 0.5 * radius; step > 0.02 * radius; step *= 0.5) {
        const Vec2d from = planar[i];
        Vec2d at = from;
        for (const auto& d : kDirections) {
          planar[i] = from + Vec2d(d[0], d[1]) * step;
          if (const double q = min_quality(i); q > best) best = q, at = planar[i];
        }
        planar[i] = at;
      }
    }
  }
  return std::all_of(disk.faces.begin(), disk.faces.end(),
                     [&](std::uint32_t f) { return quality(f) > 0; });
}

bool may_go_on(const PatchSettings& settings) {
  return !settings.keep_going || (*settings.keep_going)();
}

/// Bisects inner triangles of a placed patch until they are near the surface that they stand for.
void divide_patch(PatchMesh& mesh, FlatPatch& patch, const FlatDisk& flat,
                  const PatchSettings& settings) {
  constexpr int kMaxRounds = 16;
  const auto border = static_cast<std::uint32_t>(patch.disk.border.size());
  patch.disk.index.resize(mesh.points.size(), Disk::kOutside);
  // Tests whether the surface at the middle of some corners is near the middle of their points.
  const auto is_near = [&](const Triangle& t, std::initializer_list<int> corners) {
    Vec3 middle;
    Vec2d planar(0, 0);
    for (const int k : corners) {
      middle = middle + mesh.points[t.v[k]];
      planar += patch.planar[patch.disk.index[t.v[k]]];
    }
    const auto n = static_cast<float>(corners.size());
    const DiskPosition at = locate(flat, planar / static_cast<double>(n),
                                   patch.faces[patch.disk.index[t.v[*corners.begin()]]]);
    return length(point_at(flat, at) - middle / n) <= settings.deviation;
  };
  for (int round = 0; round < kMaxRounds && may_go_on(settings); ++round) {
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
      const Triangle& t = mesh.triangles[f];
      const std::uint32_t last =
          std::max({patch.disk.index[t.v[0]], patch.disk.index[t.v[1]], patch.disk.index[t.v[2]]});
      if (last == Disk::kOutside || last < border) continue;  // not inside the patch
      float longest = 0;
      for (int k = 0; k < 3; ++k)
        longest = std::max(longest, length(mesh.points[t.v[k]] - mesh.points[t.v[(k + 1) % 3]]));
      if (longest > settings.longest_edge || !is_near(t, {0, 1}) || !is_near(t, {1, 2}) ||
          !is_near(t, {2, 0}) || !is_near(t, {0, 1, 2}))
        chosen.push_back(f);
    }
    if (chosen.empty() || mesh.triangles.size() + 2 * chosen.size() > settings.max_triangles)
      return;
    Division division = halve_triangles(mesh.points, mesh.triangles, chosen);
    mesh.triangles = std::move(division.triangles);
    for (const auto& [a, b] : division.halved) {
      mesh.halved.push_back({a, b});
      const std::uint32_t i = patch.disk.index[a], j = patch.disk.index[b];
      Vec3 middle = (mesh.points[a] + mesh.points[b]) * 0.5f;
      const bool is_in_patch = i != Disk::kOutside && j != Disk::kOutside;
      if (is_in_patch && std::max(i, j) >= border) {
        const auto k = static_cast<std::uint32_t>(patch.planar.size());
        patch.disk.index.push_back(k);
        patch.planar.push_back((patch.planar[i] + patch.planar[j]) * 0.5);
        patch.faces.push_back(0);
        middle = place_on_disk(flat, patch, k, patch.faces[std::max(i, j)]);
      } else {
        patch.disk.index.push_back(Disk::kOutside);
      }
      mesh.points.push_back(middle);
    }
  }
}

/// Maps one patch onto a disk of the target's surface. Returns false if that is impossible.
bool map_patch(PatchMesh& mesh, FlatPatch& patch, const CarryTarget& target, FlatDisk& flat) {
  const Mesh& surface = target.surface;
  const Disk& target_disk = flat.disk;
  std::vector<Vec2d>& planar = flat.planar;
  // Map the border of the target's disk to the unit circle, by arc length.
  planar.resize(target_disk.points.size());
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
  const bool is_embedded = embed(
      flat.disk, surface.triangles, planar, [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
        const Vec3 a = surface.positions[q] - surface.positions[p],
                   b = surface.positions[r] - surface.positions[p];
        const auto edge_length = std::max(static_cast<double>(length(a)), 1e-12);
        return std::clamp(tan_half(a, b), 1e-3, 1e3) / edge_length;
      });
  if (!is_embedded) return false;
  // Place the patch's border at its closest points, and its inner points between them.
  const std::size_t border = patch.disk.border.size();
  patch.planar.resize(border);
  patch.faces.assign(patch.disk.points.size(), target_disk.faces.front());
  for (std::size_t i = 0; i < border; ++i) {
    const ClosestPoint hit = target.tree->closest(mesh.points[patch.disk.border[i]]);
    if (!flat.is_inside[hit.triangle] || hit.distance > target.edge) return false;
    const Triangle& t = surface.triangles[hit.triangle];
    const TriangleWeights w = weights_at(surface, hit);
    patch.planar[i] = planar[target_disk.index[t.v[0]]] * w.a +
                      planar[target_disk.index[t.v[1]]] * w.b +
                      planar[target_disk.index[t.v[2]]] * w.c;
    patch.faces[i] = hit.triangle;
  }
  if (!embed(patch.disk, mesh.triangles, patch.planar,
             [](std::uint32_t, std::uint32_t, std::uint32_t) { return 1.0; }) ||
      !untangle(patch, mesh.triangles))
    return false;
  // Move the inner points onto the surface.
  std::uint32_t start = patch.faces.front();
  for (std::size_t i = border; i < patch.planar.size(); ++i) {
    mesh.points[patch.disk.points[i]] = place_on_disk(flat, patch, i, start);
    start = patch.faces[i];
  }
  return true;
}

/// Finds the triangle across each side of each triangle of a closed mesh.
std::vector<Triangle> find_neighbours_by_fans(std::span<const Triangle> triangles,
                                              const Fans& fans) {
  std::vector<Triangle> neighbours(triangles.size());
  for (std::uint32_t f = 0; f < triangles.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      neighbours[f].v[k] = f;
      const std::uint32_t end = triangles[f].v[(k + 1) % 3];
      for (const std::uint32_t g : fans.around(triangles[f].v[k]))
        if (g != f && std::find(triangles[g].v, triangles[g].v + 3, end) != triangles[g].v + 3)
          neighbours[f].v[k] = g;
    }
  return neighbours;
}

}  // namespace

std::size_t map_patches(PatchMesh& mesh, std::span<const std::uint32_t> seeds,
                        const PatchSettings& settings, const CarryTarget& target,
                        std::span<const std::uint32_t> mesh_near) {
  const Mesh& surface = target.surface;
  const std::vector<Triangle>& triangles = mesh.triangles;
  const std::size_t point_count = mesh.points.size();
  const std::vector<Triangle> neighbours =
                                  find_neighbours_by_fans(triangles, Fans(point_count, triangles)),
                              target_neighbours =
                                  find_neighbours_by_fans(surface.triangles, target.fans);
  Flags is_near_seed(triangles.size(), 0);
  for (const std::uint32_t f : seeds) is_near_seed[f] = 1;
  grow(triangles, point_count, settings.rings, is_near_seed);
  const FlaggedComponents patches = find_components(neighbours, is_near_seed, /*value=*/1);
  std::vector<std::pair<FlatDisk, FlatPatch>> mapped;
  for (std::uint32_t component = 1; component < patches.size.size() && may_go_on(settings);
       ++component) {
    Flags is_selected(triangles.size(), 0);
    for (std::size_t f = 0; f < is_selected.size(); ++f)
      is_selected[f] = patches.number[f] == component;
    std::optional<Disk> disk = make_disk(triangles, neighbours, point_count, is_selected);
    if (!disk) continue;
    for (const std::uint32_t f : disk->faces) is_selected[f] = 1;
    // A wider region, so that the target's disk contains the whole patch.
    grow(triangles, point_count, /*rings=*/4, is_selected);
    Flags is_target(surface.triangles.size(), 0);
    for (std::size_t f = 0; f < is_target.size(); ++f)
      is_target[f] = is_selected[mesh_near[surface.triangles[f].v[0]]];
    const FlaggedComponents target_components =
        find_components(target_neighbours, is_target, /*value=*/1);
    if (target_components.size.size() < 2) continue;
    const std::uint32_t largest = find_largest(target_components);
    for (std::size_t f = 0; f < is_target.size(); ++f)
      is_target[f] = target_components.number[f] == largest;
    std::optional<Disk> target_disk =
        make_disk(surface.triangles, target_neighbours, surface.positions.size(), is_target);
    if (!target_disk) continue;
    FlatDisk flat{surface, target_neighbours, std::move(*target_disk)};
    flat.is_inside.assign(surface.triangles.size(), 0);
    for (const std::uint32_t f : flat.disk.faces) flat.is_inside[f] = 1;
    FlatPatch patch{std::move(*disk), {}, {}};
    if (map_patch(mesh, patch, target, flat))
      mapped.emplace_back(std::move(flat), std::move(patch));
  }
  // Bisections renumber the triangles, so they come after all patches.
  for (auto& [flat, patch] : mapped) divide_patch(mesh, patch, flat, settings);
  return mapped.size();
}

}  // namespace polymorph
