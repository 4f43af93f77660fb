#include "analyze/roughness.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "analyze/occupancy.h"
#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr double kFine = 0.01;     ///< of L: the scale at which curvature is measured
constexpr double kCoarse = 0.02;   ///< of L: what is smaller is roughness
constexpr double kRadius = 0.06;   ///< of L: domes and grooves have smaller radii
constexpr double kMinDome = 1e-4;  ///< of L^2: smaller domes are noise

/// Both principal curvatures, in 1 / cell, convex positive.
struct Curvatures {
  double larger = 0, smaller = 0;
};

/// First and second derivatives by central differences, in cells.
struct Derivatives {
  Vec3d gradient;
  Sym3d hessian;
};
Derivatives operator*(const Derivatives& a, double s) { return {a.gradient * s, a.hessian * s}; }
Derivatives operator+(const Derivatives& a, const Derivatives& b) {
  return {a.gradient + b.gradient, a.hessian + b.hessian};
}

Derivatives derivatives_at(const CellValues& field, Int3 p) {
  const Int3 n = field.cells;
  const auto value = [&](int x, int y, int z) {
    return static_cast<double>(
        field.values[field.index(std::clamp(p.x + x, 0, n.x - 1), std::clamp(p.y + y, 0, n.y - 1),
                                 std::clamp(p.z + z, 0, n.z - 1))]);
  };
  // The difference of differences over two cells: as smooth as the gradient is.
  const double middle = 2 * value(0, 0, 0);
  Derivatives d;
  d.gradient = Vec3d(value(1, 0, 0) - value(-1, 0, 0), value(0, 1, 0) - value(0, -1, 0),
                     value(0, 0, 1) - value(0, 0, -1)) *
               0.5;
  d.hessian = Sym3d{value(2, 0, 0) - middle + value(-2, 0, 0),
                    value(0, 2, 0) - middle + value(0, -2, 0),
                    value(0, 0, 2) - middle + value(0, 0, -2),
                    value(1, 1, 0) - value(1, -1, 0) - value(-1, 1, 0) + value(-1, -1, 0),
                    value(1, 0, 1) - value(1, 0, -1) - value(-1, 0, 1) + value(-1, 0, -1),
                    value(0, 1, 1) - value(0, 1, -1) - value(0, -1, 1) + value(0, -1, -1)} *
              0.25;
  return d;
}

/// Of the level set of a field that grows inward: the eigenvalues of -H / |g| across g.
Curvatures curvatures_of(const Derivatives& d) {
  constexpr double kFlat = 1e-12;
  const double slope = length(d.gradient) + kFlat;
  const Vec3d normal = d.gradient * (1 / slope);
  const Vec3d aside = std::abs(normal.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d a = normalized(cross(normal, aside)), b = cross(normal, a);
  const Mat3 hessian = to_mat3(d.hessian);
  const auto form = [&](const Vec3d& x, const Vec3d& y) { return -dot(x, hessian * y) / slope; };
  const double aa = form(a, a), bb = form(b, b), ab = form(a, b);
  const double mean = (aa + bb) / 2, half = (aa - bb) / 2, apart = std::sqrt(half * half + ab * ab);
  return {mean + apart, mean - apart};
}

std::vector<Curvatures> curvatures_of(const CellValues& field, const IsoSurface& surface) {
  std::vector<Curvatures> result(surface.positions.size());
  parallel_for(
      static_cast<std::int64_t>(result.size()),
      [&](std::int64_t i) {
        const auto v = static_cast<std::size_t>(i);
        const Int3 p = surface.from[v];
        const int axis = surface.axis[v];
        const Int3 q = {p.x + (axis == 0), p.y + (axis == 1), p.z + (axis == 2)};
        const Vec3 at = surface.positions[v];
        const double t = static_cast<double>(axis == 0   ? at.x - static_cast<float>(p.x)
                                             : axis == 1 ? at.y - static_cast<float>(p.y)
                                                         : at.z - static_cast<float>(p.z));
        result[v] =
            curvatures_of(derivatives_at(field, p) * (1 - t) + derivatives_at(field, q) * t);
      },
      256);
  return result;
}

/// Connected sets of the chosen vertices whose area is larger than `min_area`.
int count_patches(const IsoSurface& surface, const std::vector<bool>& chosen,
                  const std::vector<double>& areas, double min_area) {
  DisjointSets patches(chosen.size());
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t.v[k], b = t.v[(k + 1) % 3];
      if (chosen[a] && chosen[b]) patches.join(a, b);
    }
  std::vector<double> area(chosen.size(), 0);
  for (std::uint32_t v = 0; v < chosen.size(); ++v)
    if (chosen[v]) area[patches.find(v)] += areas[v];
  return static_cast<int>(
      std::count_if(area.begin(), area.end(), [&](double a) { return a > min_area; }));
}

void measure_curvature(const CellValues& occupancy, double volume, double size, Roughness& result) {
  constexpr double kReach = 4;
  const CellValues field = smoothed(occupancy, kFine * size, kReach);
  const IsoSurface surface = iso_surface(field, level_of_volume(field, volume));
  const std::vector<Curvatures> curvatures = curvatures_of(field, surface);
  const std::vector<double> areas = vertex_areas(surface);
  // No radius is smaller than the scale of the smoothing.
  const double max_curvature = 1 / (kFine * size), tight = 1 / (kRadius * size);
  double total = 0, grooves = 0, area = 0;
  std::vector<bool> dome(curvatures.size());
  for (std::size_t v = 0; v < curvatures.size(); ++v) {
    const auto [larger, smaller] = curvatures[v];
    total += std::abs(std::clamp(larger, -max_curvature, max_curvature) *
                      std::clamp(smaller, -max_curvature, max_curvature)) *
             areas[v];
    if (smaller < -tight) grooves += areas[v];
    dome[v] = smaller > tight;
    area += areas[v];
  }
  result.tac = total / (4 * std::numbers::pi);
  result.groove = area > 0 ? 100 * grooves / area : 0;
  result.bumps = count_patches(surface, dome, areas, kMinDome * size * size);
}

/// The distance of points from a surface as fine as the grid: to the plane of the nearest vertex,
/// or to the vertex where that is more than two cells off.
class VertexPlanes {
 public:
  /// `cells`: of the grid that the surface is on.
  VertexPlanes(const IsoSurface& surface, Int3 cells)
      : cells_(cells),
        start_(static_cast<std::size_t>(cells.x) * static_cast<std::size_t>(cells.y) *
                   static_cast<std::size_t>(cells.z) +
               1),
        normals_(surface.positions.size()),
        points_(surface.positions) {
    for (const Triangle& t : surface.triangles) {
      const Vec3d a(points_[t.v[0]]), b(points_[t.v[1]]), c(points_[t.v[2]]);
      const Vec3d up = cross(b - a, c - a);
      for (const std::uint32_t v : t.v) normals_[v] = normals_[v] + up;
    }
    for (Vec3d& n : normals_) n = normalized(n);
    for (const Int3& p : surface.from) ++start_[index(p) + 1];
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    sorted_.resize(points_.size());
    for (std::uint32_t v = 0; v < points_.size(); ++v) sorted_[next[index(surface.from[v])]++] = v;
  }

  /// At most `max_distance`.
  double distance(Vec3 from, double max_distance) const {
    const Int3 p = {static_cast<int>(from.x), static_cast<int>(from.y), static_cast<int>(from.z)};
    Nearest nearest;
    const int rings = static_cast<int>(max_distance) + 1;
    for (int r = 0; r <= rings; ++r) {
      // Whatever a vertex of this ring comes from, it is at least r - 1 cells off.
      if (r > 1 && nearest.square <= static_cast<double>(r - 1) * (r - 1)) break;
      look_around(p, r, from, nearest);
    }
    constexpr double kNear = 2;
    const double straight = std::sqrt(nearest.square);
    if (straight > kNear) return std::min(straight, max_distance);
    const Vec3d way = Vec3d(from) - Vec3d(points_[nearest.vertex]);
    return std::min(std::abs(dot(way, normals_[nearest.vertex])), max_distance);
  }

 private:
  struct Nearest {
    double square = std::numeric_limits<double>::infinity();
    std::uint32_t vertex = 0;
  };
  std::size_t index(Int3 p) const {
    return (static_cast<std::size_t>(p.x) * static_cast<std::size_t>(cells_.y) +
            static_cast<std::size_t>(p.y)) *
               static_cast<std::size_t>(cells_.z) +
           static_cast<std::size_t>(p.z);
  }
  /// The cells that are r away along some axis.
  void look_around(Int3 p, int r, Vec3 from, Nearest& nearest) const {
    for (int x = std::max(p.x - r, 0); x <= std::min(p.x + r, cells_.x - 1); ++x)
      for (int y = std::max(p.y - r, 0); y <= std::min(p.y + r, cells_.y - 1); ++y) {
        const bool side = std::abs(x - p.x) == r || std::abs(y - p.y) == r;
        const int step = side || r == 0 ? 1 : 2 * r;
        for (int z = p.z - r; z <= p.z + r; z += step)
          if (z >= 0 && z < cells_.z) look_into(index({x, y, z}), from, nearest);
      }
  }
  void look_into(std::size_t cell, Vec3 from, Nearest& nearest) const {
    for (std::uint32_t i = start_[cell]; i < start_[cell + 1]; ++i) {
      const Vec3d way = Vec3d(from) - Vec3d(points_[sorted_[i]]);
      const double square = dot(way, way);
      if (square < nearest.square) nearest = {square, sorted_[i]};
    }
  }

  Int3 cells_;
  std::vector<std::uint32_t> start_;   ///< of each cell's vertices in `sorted_`
  std::vector<std::uint32_t> sorted_;  ///< by the cell that they come from
  std::vector<Vec3d> normals_;
  const std::vector<Vec3>& points_;
};

double rho_of(const CellValues& occupancy, double volume, double size) {
  constexpr double kReach = 3.5;
  const CellValues field = smoothed(occupancy, kCoarse * size, kReach);
  const IsoSurface smooth = iso_surface(field, level_of_volume(field, volume));
  // Its own surface, less the steps of the cells.
  constexpr double kSteps = 0.6, kStepsReach = 4;
  const IsoSurface own = iso_surface(smoothed(occupancy, kSteps, kStepsReach), 0.5f);
  const VertexPlanes planes(smooth, field.cells);
  std::vector<double> distance(own.positions.size());
  parallel_for(
      static_cast<std::int64_t>(distance.size()),
      [&](std::int64_t i) {
        const auto v = static_cast<std::size_t>(i);
        distance[v] = planes.distance(own.positions[v], kCoarse * size);
      },
      256);
  const std::vector<double> areas = vertex_areas(own);
  double sum = 0, area = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    sum += areas[v] * distance[v] * distance[v];
    area += areas[v];
  }
  return area > 0 ? 100 * std::sqrt(sum / area) / size : 0;
}

}  // namespace

RoughnessScale roughness_scale(const Box& ends, int resolution) {
  const Vec3 size = ends.size();
  return {static_cast<double>(ends.diagonal()),
          static_cast<double>(std::max({size.x, size.y, size.z})) / resolution};
}

Roughness roughness_of(const Mesh& mesh, const RoughnessScale& scale) {
  Roughness result;
  const Vec3 side = box_of(mesh.positions).size();
  constexpr double kMaxCells = 256, kMinMargin = 6;
  const double cell =
      std::max(scale.cell, static_cast<double>(std::max({side.x, side.y, side.z})) / kMaxCells);
  if (!(cell > 0 && scale.size > 0) || mesh.triangles.empty()) return result;
  // What the Gaussians reach, and more.
  const double margin = std::max(4 * kCoarse * scale.size, kMinMargin * cell);
  const CellValues occupancy = occupancy_of(mesh, cell, margin);
  const double volume = sum_of(occupancy);
  constexpr double kMinVolume = 8;
  if (volume < kMinVolume) return result;
  measure_curvature(occupancy, volume, scale.size / cell, result);
  result.rho = rho_of(occupancy, volume, scale.size / cell);
  return result;
}

}  // namespace polymorph
