#include "analyze/roughness.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include "analyze/occupancy.h"
#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr double kFineSigma = 0.01;    ///< over L: smoothing before curvature is measured
constexpr double kCoarseSigma = 0.02;  ///< over L: smoothing that removes the detail
constexpr double kMaxRadius = 0.06;    ///< over L: largest radius of domes and grooves
constexpr double kMinDomeArea = 1e-4;  ///< over L^2: smaller domes are noise

/// Both principal curvatures, in 1 / cell; positive where the solid is convex.
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

/// Computes the derivatives at the center of cell `p`. Cells beyond the border repeat the border.
Derivatives derivatives_at(const CellValues& field, Int3 p) {
  const Int3 n = field.cells;
  const auto value = [&](int x, int y, int z) {
    return static_cast<double>(
        field.values[field.index(std::clamp(p.x + x, 0, n.x - 1), std::clamp(p.y + y, 0, n.y - 1),
                                 std::clamp(p.z + z, 0, n.z - 1))]);
  };
  // Central differences of central differences: the second derivatives are smoothed over as many
  // cells as the gradient.
  const double twice_center = 2 * value(0, 0, 0);
  Derivatives d;
  d.gradient = Vec3d(value(1, 0, 0) - value(-1, 0, 0), value(0, 1, 0) - value(0, -1, 0),
                     value(0, 0, 1) - value(0, 0, -1)) *
               0.5;
  d.hessian = Sym3d{value(2, 0, 0) - twice_center + value(-2, 0, 0),
                    value(0, 2, 0) - twice_center + value(0, -2, 0),
                    value(0, 0, 2) - twice_center + value(0, 0, -2),
                    value(1, 1, 0) - value(1, -1, 0) - value(-1, 1, 0) + value(-1, -1, 0),
                    value(1, 0, 1) - value(1, 0, -1) - value(-1, 0, 1) + value(-1, 0, -1),
                    value(0, 1, 1) - value(0, 1, -1) - value(0, -1, 1) + value(0, -1, -1)} *
              0.25;
  return d;
}

/// Computes the principal curvatures of the level set of a field that increases inward: the
/// eigenvalues of -H / |g| in the plane perpendicular to g.
Curvatures principal_curvatures(const Derivatives& d) {
  constexpr double kFlat = 1e-12;  // avoids a division by 0
  const double slope = length(d.gradient) + kFlat;
  const Vec3d normal = d.gradient * (1 / slope);
  const Vec3d helper_axis = std::abs(normal.x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d a = normalized(cross(normal, helper_axis)), b = cross(normal, a);
  const Mat3 hessian = to_mat3(d.hessian);
  const auto second_fundamental_form = [&](const Vec3d& x, const Vec3d& y) {
    return -dot(x, hessian * y) / slope;
  };
  const double aa = second_fundamental_form(a, a), bb = second_fundamental_form(b, b),
               ab = second_fundamental_form(a, b);
  // The eigenvalues of the matrix [[aa, ab], [ab, bb]] are mean +- half_difference.
  const double mean = (aa + bb) / 2, half = (aa - bb) / 2;
  const double half_difference = std::sqrt(half * half + ab * ab);
  return {mean + half_difference, mean - half_difference};
}

/// Computes the principal curvatures at every vertex of the isosurface of `field`.
std::vector<Curvatures> compute_curvatures(const CellValues& field, const IsoSurface& surface) {
  std::vector<Curvatures> result(surface.positions.size());
  parallel_for(
      static_cast<std::int64_t>(result.size()),
      [&](std::int64_t i) {
        const auto v = static_cast<std::size_t>(i);
        const Int3 p = surface.vertex_cell[v];
        const int axis = surface.vertex_axis[v];
        const Int3 q = {p.x + (axis == 0), p.y + (axis == 1), p.z + (axis == 2)};
        const Vec3 position = surface.positions[v];
        // The vertex lies at p + t (q - p).
        const double t = static_cast<double>(axis == 0   ? position.x - static_cast<float>(p.x)
                                             : axis == 1 ? position.y - static_cast<float>(p.y)
                                                         : position.z - static_cast<float>(p.z));
        result[v] =
            principal_curvatures(derivatives_at(field, p) * (1 - t) + derivatives_at(field, q) * t);
      },
      /*grain=*/256);
  return result;
}

/// Counts the connected sets of chosen vertices whose area is larger than `min_area`.
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

/// Measures `tac`, `bumps` and `groove` of a solid of `volume` cells; `size` is L in cells.
void measure_curvature(const CellValues& occupancy, double volume, double size, Roughness& result) {
  constexpr double kCutoff = 4;  // in standard deviations
  const CellValues field = smooth(occupancy, kFineSigma * size, kCutoff);
  const IsoSurface surface = extract_iso_surface(field, find_level_of_volume(field, volume));
  const std::vector<Curvatures> curvatures = compute_curvatures(field, surface);
  const std::vector<double> areas = vertex_areas(surface);
  // Smoothing leaves no radius smaller than its sigma; larger curvatures are numerical noise.
  const double max_curvature = 1 / (kFineSigma * size), min_curvature = 1 / (kMaxRadius * size);
  double total = 0, grooves = 0, area = 0;
  std::vector<bool> is_dome(curvatures.size());
  for (std::size_t v = 0; v < curvatures.size(); ++v) {
    const auto [larger, smaller] = curvatures[v];
    total += std::abs(std::clamp(larger, -max_curvature, max_curvature) *
                      std::clamp(smaller, -max_curvature, max_curvature)) *
             areas[v];
    if (smaller < -min_curvature) grooves += areas[v];
    is_dome[v] = smaller > min_curvature;
    area += areas[v];
  }
  result.tac = total / (4 * std::numbers::pi);
  result.groove = area > 0 ? 100 * grooves / area : 0;
  result.bumps = count_patches(surface, is_dome, areas, kMinDomeArea * size * size);
}

/// Approximate distances to a surface whose triangles are about as large as a cell: the distance to
/// the tangent plane at the nearest vertex, or to the vertex itself if it is more than two cells
/// away.
class VertexPlanes {
 public:
  /// `grid` is the grid that the surface was extracted from; both must outlive this.
  VertexPlanes(const IsoSurface& surface, const CellValues& grid)
      : grid_(grid),
        cell_start_(grid.values.size() + 1),
        normals_(surface.positions.size()),
        points_(surface.positions) {
    for (const Triangle& t : surface.triangles) {
      const Vec3d a(points_[t.v[0]]), b(points_[t.v[1]]), c(points_[t.v[2]]);
      const Vec3d area_normal = cross(b - a, c - a);
      for (const std::uint32_t v : t.v) normals_[v] = normals_[v] + area_normal;
    }
    for (Vec3d& n : normals_) n = normalized(n);
    for (const Int3& p : surface.vertex_cell) ++cell_start_[index(p) + 1];
    std::partial_sum(cell_start_.begin(), cell_start_.end(), cell_start_.begin());
    std::vector<std::uint32_t> next(cell_start_.begin(), cell_start_.end() - 1);
    sorted_.resize(points_.size());
    for (std::uint32_t v = 0; v < points_.size(); ++v)
      sorted_[next[index(surface.vertex_cell[v])]++] = v;
  }

  /// Returns the distance of the point, clamped to `max_distance`.
  double distance(Vec3 point, double max_distance) const {
    const Int3 p = {static_cast<int>(point.x), static_cast<int>(point.y),
                    static_cast<int>(point.z)};
    Nearest nearest;
    const int rings = static_cast<int>(max_distance) + 1;
    for (int r = 0; r <= rings; ++r) {
      // A vertex of a cell of this ring is at least r - 1 cells away.
      if (r > 1 && nearest.distance2 <= static_cast<double>(r - 1) * (r - 1)) break;
      search_ring(p, r, point, nearest);
    }
    constexpr double kMaxPlaneDistance = 2;  // cells
    const double vertex_distance = std::sqrt(nearest.distance2);
    if (vertex_distance > kMaxPlaneDistance) return std::min(vertex_distance, max_distance);
    const Vec3d offset = Vec3d(point) - Vec3d(points_[nearest.vertex]);
    return std::min(std::abs(dot(offset, normals_[nearest.vertex])), max_distance);
  }

 private:
  struct Nearest {
    double distance2 = std::numeric_limits<double>::infinity();
    std::uint32_t vertex = 0;
  };
  std::size_t index(Int3 p) const { return grid_.index(p.x, p.y, p.z); }
  /// Searches the cells at Chebyshev distance r from p.
  void search_ring(Int3 p, int r, Vec3 point, Nearest& nearest) const {
    const Int3 cells = grid_.cells;
    for (int x = std::max(p.x - r, 0); x <= std::min(p.x + r, cells.x - 1); ++x)
      for (int y = std::max(p.y - r, 0); y <= std::min(p.y + r, cells.y - 1); ++y) {
        const bool is_lateral = std::abs(x - p.x) == r || std::abs(y - p.y) == r;
        const int step =
            is_lateral || r == 0 ? 1 : 2 * r;  // else only the first and last cell of the column
        for (int z = p.z - r; z <= p.z + r; z += step)
          if (z >= 0 && z < cells.z) search_cell(index({x, y, z}), point, nearest);
      }
  }
  void search_cell(std::size_t cell, Vec3 point, Nearest& nearest) const {
    for (std::uint32_t i = cell_start_[cell]; i < cell_start_[cell + 1]; ++i) {
      const Vec3d offset = Vec3d(point) - Vec3d(points_[sorted_[i]]);
      const double distance2 = dot(offset, offset);
      if (distance2 < nearest.distance2) nearest = {distance2, sorted_[i]};
    }
  }

  const CellValues& grid_;
  std::vector<std::uint32_t> cell_start_;  ///< index of each cell's first vertex in `sorted_`
  std::vector<std::uint32_t> sorted_;      ///< vertices, sorted by their cell
  std::vector<Vec3d> normals_;
  const std::vector<Vec3>& points_;
};

/// Measures `Roughness::rho` of a solid of `volume` cells; `size` is L in cells.
double measure_rms_detail(const CellValues& occupancy, double volume, double size) {
  constexpr double kCutoff = 3.5;  // in standard deviations
  const CellValues field = smooth(occupancy, kCoarseSigma * size, kCutoff);
  const IsoSurface smooth_surface = extract_iso_surface(field, find_level_of_volume(field, volume));
  // The solid's own surface; this smoothing only removes the staircase of the cells.
  constexpr double kStaircaseSigma = 0.6, kStaircaseCutoff = 4;
  const IsoSurface surface =
      extract_iso_surface(smooth(occupancy, kStaircaseSigma, kStaircaseCutoff), 0.5f);
  const VertexPlanes planes(smooth_surface, field);
  std::vector<double> distance(surface.positions.size());
  parallel_for(
      static_cast<std::int64_t>(distance.size()),
      [&](std::int64_t i) {
        const auto v = static_cast<std::size_t>(i);
        distance[v] = planes.distance(surface.positions[v], kCoarseSigma * size);
      },
      /*grain=*/256);
  const std::vector<double> areas = vertex_areas(surface);
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

Roughness measure_roughness(const Mesh& mesh, const RoughnessScale& scale) {
  Roughness result;
  const Vec3 extent = bounding_box(mesh.positions).size();
  constexpr double kMaxCells = 256,  // along the longest side of the mesh's box
      kMinMargin = 6;                // cells
  const double cell = std::max(
      scale.cell, static_cast<double>(std::max({extent.x, extent.y, extent.z})) / kMaxCells);
  if (!(cell > 0 && scale.size > 0) || mesh.triangles.empty()) return result;
  // The margin is wider than the cutoff of every Gaussian, so that none is clipped.
  const double margin = std::max(4 * kCoarseSigma * scale.size, kMinMargin * cell);
  const CellValues occupancy = compute_occupancy(mesh, cell, margin);
  const double volume = sum_values(occupancy);
  constexpr double kMinVolume = 8;  // cells
  if (volume < kMinVolume) return result;
  measure_curvature(occupancy, volume, scale.size / cell, result);
  result.rho = measure_rms_detail(occupancy, volume, scale.size / cell);
  return result;
}

}  // namespace polymorph
