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

/// Numbers of the connected parts of the triangles where `in` is `value`, from 1 on, and sizes.
struct Parts {
  std::vector<std::uint32_t> number;  ///< 0: not `value`
  std::vector<std::size_t> size;      ///< size[0] stands for nothing
};
Parts parts_of(const std::vector<Triangle>& beside, const Flags& in, std::uint8_t value) {
  Parts parts{std::vector<std::uint32_t>(in.size(), 0), {0}};
  std::vector<std::uint32_t> stack;
  for (std::uint32_t f = 0; f < in.size(); ++f) {
    if (in[f] != value || parts.number[f] != 0) continue;
    const auto part = static_cast<std::uint32_t>(parts.size.size());
    parts.size.push_back(0);
    stack.push_back(f);
    parts.number[f] = part;
    while (!stack.empty()) {
      const std::uint32_t g = stack.back();
      stack.pop_back();
      ++parts.size[part];
      for (const std::uint32_t n : beside[g].v)
        if (in[n] == value && parts.number[n] == 0) parts.number[n] = part, stack.push_back(n);
    }
  }
  return parts;
}

std::uint32_t largest(const Parts& parts) {
  return static_cast<std::uint32_t>(std::max_element(parts.size.begin(), parts.size.end()) -
                                    parts.size.begin());
}

void grow(std::span<const Triangle> triangles, std::size_t points, int rings, Flags& in) {
  for (int r = 0; r < rings; ++r) {
    Flags touched(points, 0);
    for (std::size_t f = 0; f < in.size(); ++f)
      if (in[f])
        for (const std::uint32_t v : triangles[f].v) touched[v] = 1;
    for (std::size_t f = 0; f < in.size(); ++f)
      if (!in[f])
        in[f] =
            touched[triangles[f].v[0]] || touched[triangles[f].v[1]] || touched[triangles[f].v[2]];
  }
}

/// A disk of triangles: its border's points in order, and all its points.
struct Disk {
  std::vector<std::uint32_t> faces, border, points;
  std::unordered_map<std::uint32_t, std::uint32_t> number;  ///< of a point: its place in `points`
};

/// The connected part `in`, without holes, as a disk; border points are the first of its points.
std::optional<Disk> disk_of(std::span<const Triangle> triangles,
                            const std::vector<Triangle>& beside, std::size_t points, Flags in) {
  for (int tries = 0; tries < 8; ++tries) {
    const Parts outside = parts_of(beside, in, 0);
    if (outside.size.size() < 2) return std::nullopt;
    const std::uint32_t keep = largest(outside);
    for (std::size_t f = 0; f < in.size(); ++f)
      if (!in[f] && outside.number[f] != keep) in[f] = 1;
    std::map<std::uint32_t, std::uint32_t> next;
    Flags pinched(points, 0);
    bool is_pinched = false;
    for (std::uint32_t f = 0; f < in.size(); ++f) {
      if (!in[f]) continue;
      for (int k = 0; k < 3; ++k) {
        if (in[beside[f].v[k]]) continue;
        const auto [at, fresh] = next.emplace(triangles[f].v[k], triangles[f].v[(k + 1) % 3]);
        if (!fresh) pinched[triangles[f].v[k]] = 1, is_pinched = true;
      }
    }
    if (is_pinched) {
      for (std::size_t f = 0; f < in.size(); ++f)
        for (const std::uint32_t v : triangles[f].v) in[f] |= pinched[v];
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
    if (disk.border.size() != next.size()) return std::nullopt;  // several borders
    disk.points = disk.border;
    for (std::uint32_t i = 0; i < disk.border.size(); ++i) disk.number[disk.border[i]] = i;
    for (std::uint32_t f = 0; f < in.size(); ++f) {
      if (!in[f]) continue;
      disk.faces.push_back(f);
      for (const std::uint32_t p : triangles[f].v)
        if (disk.number.emplace(p, static_cast<std::uint32_t>(disk.points.size())).second)
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

/// The inner points of a disk in the plane, each the mean of its neighbours by the weights; `flat`
/// holds the border's.
template <class Weight>
bool embed(const Disk& disk, std::span<const Triangle> triangles, std::vector<Vec2d>& flat,
           const Weight& weight) {
  const auto border = disk.border.size();
  const auto inner = static_cast<Eigen::Index>(disk.points.size() - border);
  flat.resize(disk.points.size());
  if (inner == 0) return true;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(inner, 2);
  std::vector<double> sums(static_cast<std::size_t>(inner), 0.0);
  for (const std::uint32_t f : disk.faces)
    for (int k = 0; k < 3; ++k)
      for (const int step : {1, 2}) {
        const std::uint32_t p = triangles[f].v[k], q = triangles[f].v[(k + step) % 3],
                            r = triangles[f].v[(k + 3 - step) % 3];
        const std::uint32_t i = disk.number.at(p), j = disk.number.at(q);
        if (i < border) continue;
        const double w = weight(p, q, r);
        const auto row = static_cast<Eigen::Index>(i - border);
        sums[i - border] += w;
        if (j < border)
          right.row(row) += w * flat[j].transpose();
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
  const Eigen::MatrixX2d x = solver.solve(right);
  for (Eigen::Index i = 0; i < inner; ++i) flat[border + static_cast<std::size_t>(i)] = x.row(i);
  return true;
}

struct Where {
  std::uint32_t face = 0;
  double weights[3] = {1, 0, 0};
};

/// The disk's face that a point of the plane is in.
Where locate(const Disk& disk, std::span<const Triangle> triangles, const std::vector<Vec2d>& flat,
             Vec2d p) {
  Where best;
  double least = -1e300;
  for (const std::uint32_t f : disk.faces) {
    const Triangle& t = triangles[f];
    const Vec2d a = flat[disk.number.at(t.v[0])], b = flat[disk.number.at(t.v[1])] - a,
                c = flat[disk.number.at(t.v[2])] - a, d = p - a;
    const double area = b.x() * c.y() - b.y() * c.x();
    if (!(std::abs(area) > 0)) continue;
    const double u = (d.x() * c.y() - d.y() * c.x()) / area,
                 v = (b.x() * d.y() - b.y() * d.x()) / area;
    const double inside = std::min({1 - u - v, u, v});
    if (inside > least) {
      least = inside;
      best = {f, {1 - u - v, u, v}};
      if (inside >= 0) break;
    }
  }
  for (double& w : best.weights) w = std::max(w, 0.0);
  const double sum = best.weights[0] + best.weights[1] + best.weights[2];
  for (double& w : best.weights) w /= sum;
  return best;
}

bool map_patch(std::vector<Vec3>& points, std::span<const Triangle> triangles, const Disk& patch,
               const Mesh& surface, const Disk& ground, const ClosestPointQuery& closest) {
  // The ground on a circle.
  std::vector<Vec2d> flat(ground.points.size());
  double around = 0;
  std::vector<double> along;
  for (std::size_t i = 0; i < ground.border.size(); ++i) {
    along.push_back(around);
    around += static_cast<double>(
        length(surface.positions[ground.border[(i + 1) % ground.border.size()]] -
               surface.positions[ground.border[i]]));
  }
  for (std::size_t i = 0; i < ground.border.size(); ++i) {
    const double angle = 2 * 3.14159265358979 * along[i] / around;
    flat[i] = {exact::cos(angle), exact::sin(angle)};
  }
  const auto tan_half = [&](Vec3 a, Vec3 b) {
    const double c = static_cast<double>(dot(a, b)), s = static_cast<double>(length(cross(a, b)));
    const double l = std::sqrt(c * c + s * s);
    return s > 1e-12 * l ? (l - c) / s : (c > 0 ? 1e-6 : 1e6);
  };
  const bool is_flat = embed(ground, surface.triangles, flat,
                             [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
                               const Vec3 a = surface.positions[q] - surface.positions[p],
                                          b = surface.positions[r] - surface.positions[p];
                               const auto far = std::max(static_cast<double>(length(a)), 1e-12);
                               return std::clamp(tan_half(a, b), 1e-3, 1e3) / far;
                             });
  if (!is_flat) return false;
  Flags is_ground(surface.triangles.size(), 0);
  for (const std::uint32_t f : ground.faces) is_ground[f] = 1;
  std::vector<Vec2d> mapped(patch.points.size());
  for (std::size_t i = 0; i < patch.border.size(); ++i) {
    const ClosestPoint hit = closest.closest(points[patch.border[i]]);
    if (!is_ground[hit.triangle]) return false;
    const Triangle& t = surface.triangles[hit.triangle];
    const TriangleWeights w = closest_on_triangle(
        hit.point, surface.positions[t.v[0]], surface.positions[t.v[1]], surface.positions[t.v[2]]);
    mapped[i] = flat[ground.number.at(t.v[0])] * w.a + flat[ground.number.at(t.v[1])] * w.b +
                flat[ground.number.at(t.v[2])] * w.c;
  }
  if (!embed(patch, triangles, mapped,
             [](std::uint32_t, std::uint32_t, std::uint32_t) { return 1.0; }))
    return false;
  for (std::size_t i = patch.border.size(); i < mapped.size(); ++i) {
    const Where at = locate(ground, surface.triangles, flat, mapped[i]);
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
                        std::span<const std::uint32_t> seeds, int rings, const CarryTarget& target,
                        std::span<const std::uint32_t> mesh_near) {
  const Mesh& surface = target.surface;
  const std::vector<Triangle> beside = neighbours_of(triangles),
                              ground_beside = neighbours_of(surface.triangles);
  Flags near(triangles.size(), 0);
  for (const std::uint32_t f : seeds) near[f] = 1;
  grow(triangles, points.size(), rings, near);
  const Parts patches = parts_of(beside, near, 1);
  std::size_t done = 0;
  for (std::uint32_t part = 1; part < patches.size.size(); ++part) {
    Flags in(triangles.size(), 0);
    for (std::size_t f = 0; f < in.size(); ++f) in[f] = patches.number[f] == part;
    const std::optional<Disk> patch = disk_of(triangles, beside, points.size(), in);
    if (!patch) continue;
    for (const std::uint32_t f : patch->faces) in[f] = 1;
    grow(triangles, points.size(), 4, in);
    Flags under(surface.triangles.size(), 0);
    for (std::size_t f = 0; f < under.size(); ++f)
      under[f] = in[mesh_near[surface.triangles[f].v[0]]];
    const Parts grounds = parts_of(ground_beside, under, 1);
    if (grounds.size.size() < 2) continue;
    const std::uint32_t keep = largest(grounds);
    for (std::size_t f = 0; f < under.size(); ++f) under[f] = grounds.number[f] == keep;
    const std::optional<Disk> ground =
        disk_of(surface.triangles, ground_beside, surface.positions.size(), under);
    if (!ground) continue;
    done += map_patch(points, triangles, *patch, surface, *ground, *target.tree);
  }
  return done;
}

}  // namespace polymorph
