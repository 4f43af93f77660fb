#include "field/thin_parts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include "base/array3.h"
#include "base/parallel.h"
#include "base/result.h"
#include "field/gaussian_filter.h"
#include "mesh/normals.h"
#include "mesh/thickness.h"
#include "mesh/triangle_bvh.h"
#include "model/clustered_model.h"

namespace polymorph {
namespace {

Vec3 to_vector(int x, int y, int z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// Index steps of a grid's values along y and z.
struct Strides {
  std::size_t row, layer;
  explicit Strides(Int3 n) : row(array3_index(n, 0, 1, 0)), layer(array3_index(n, 0, 0, 1)) {}
};

/// Tests whether a point lies on the ridge of a thin part or of a narrow gap: the magnitudes of the
/// distances increase towards it from both sides and are below `radius` there. The point must not
/// be on the grid's border.
bool is_on_ridge(const DistanceGrid& distances, int x, int y, int z, float radius) {
  // Along the ridge between two faces distances increase by the sine of half the angle between
  // them. This bound accepts angles up to 97 degrees.
  constexpr float kMaxSlope = 0.75f;
  const Strides stride(distances.grid.points);
  const std::size_t i = array3_index(distances.grid.points, x, y, z);
  const std::vector<float>& values = distances.values;
  const float v = std::fabs(values[i]);
  if (!(v > 0) || v >= radius) return false;
  const auto slope = [&](std::size_t step) { return values[i + step] - values[i - step]; };
  const Vec3 gradient{slope(1), slope(stride.row), slope(stride.layer)};
  return length(gradient) < 2 * distances.grid.cell * kMaxSlope;
}

/// Computes the squared distance, in cells, of each point to the nearest ridge, by a distance
/// transform along one axis after the other. The values of points further than `cells` away are
/// above cells^2, but not exact.
std::vector<std::uint16_t> squared_ridge_distances(const DistanceGrid& distances, float radius,
                                                   int cells) {
  constexpr std::uint16_t kFar = 0x3fff;  // plus the squares along two axes, it fits 16 bits
  PM_CHECK(2 * cells * cells < kFar);
  const Int3 n = distances.grid.points;
  const Strides stride(n);
  std::vector<std::uint16_t> squares(distances.values.size(), kFar);
  const auto for_each_near = [&](int at, int points, const auto& f) {
    for (int k = std::max(at - cells, 0); k <= std::min(at + cells, points - 1); ++k)
      f(k, static_cast<std::uint16_t>((k - at) * (k - at)));
  };
  parallel_for(n.z - 2, [&](std::int64_t layer) {
    const int z = static_cast<int>(layer) + 1;
    for (int y = 1; y + 1 < n.y; ++y)
      for (int x = 1; x + 1 < n.x; ++x)
        if (is_on_ridge(distances, x, y, z, radius))
          for_each_near(x, n.x, [&](int k, std::uint16_t distance2) {
            std::uint16_t& v = squares[array3_index(n, k, y, z)];
            v = std::min(v, distance2);
          });
  });
  // In each plane, combines `count` rows along x that are `step` values apart.
  const auto combine_rows = [&](int planes, std::size_t plane_stride, int count, std::size_t step) {
    parallel_for(planes, [&](std::int64_t plane) {
      std::uint16_t* rows = squares.data() + static_cast<std::size_t>(plane) * plane_stride;
      std::vector<std::uint16_t> copy(stride.row * static_cast<std::size_t>(count));
      for (int i = 0; i < count; ++i)
        std::copy_n(rows + static_cast<std::size_t>(i) * step, stride.row,
                    copy.data() + static_cast<std::size_t>(i) * stride.row);
      for (int i = 0; i < count; ++i) {
        std::uint16_t* to = rows + static_cast<std::size_t>(i) * step;
        for_each_near(i, count, [&](int k, std::uint16_t distance2) {
          const std::uint16_t* from = copy.data() + static_cast<std::size_t>(k) * stride.row;
          for (std::size_t x = 0; x < stride.row; ++x)
            to[x] = std::min(to[x], static_cast<std::uint16_t>(from[x] + distance2));
        });
      }
    });
  };
  combine_rows(n.z, stride.layer, n.y, stride.row);
  combine_rows(n.y, stride.row, n.z, stride.layer);
  return squares;
}

/// Key of the half cell that contains a position in cells: 20 bits per axis.
std::uint64_t half_cell_key(Vec3 at) {
  const auto half_cells = [](float x) { return static_cast<std::uint64_t>(2 * std::max(x, 0.0f)); };
  return half_cells(at.x) << 40 | half_cells(at.y) << 20 | half_cells(at.z);
}

/// Finds midpoints of walls that are thinner than twice `radius` and not inside a thick part, as
/// positions in cells, one list per layer of points. Walls are found by rays through the model,
/// because a wall between grid points makes no value of `distances` positive.
std::vector<std::vector<Vec3>> find_thin_walls(const Model& original, const DistanceGrid& distances,
                                               float radius) {
  // In cells: the spheres that raise_around() fills around adjacent midpoints overlap.
  constexpr double kSpacing = 0.7;
  constexpr double kMinCosine = 0.9;  // cos 26 degrees: faces at a wider angle form a sharp edge
  constexpr double kMaxSamples = 400'000;
  const Grid& grid = distances.grid;
  const double spacing = std::max(kSpacing * static_cast<double>(grid.cell),
                                  std::sqrt(area_of(original) / kMaxSamples));
  TriangleBvh bvh = build_split_bvh(original.points, original.triangles);
  // A ray through thousands of scattered long triangles hits walls everywhere, and a ray through a
  // point that thousands of triangles share touches all of them. Such models are clustered first.
  const std::optional<ClusteredModel> clustered =
      bvh.is_split ? cluster_long_triangles(original) : std::nullopt;
  // With more than half of the triangles, clustering saves little.
  const bool use_clustered =
      clustered &&
      (clustered->thinned || 2 * clustered->model.triangles.size() < original.triangles.size());
  const Model& model = use_clustered ? clustered->model : original;
  if (use_clustered) bvh = build_split_bvh(model.points, model.triangles);
  std::vector<std::vector<Vec3>> layers(static_cast<std::size_t>(grid.points.z));
  // One midpoint per half cell: thin triangles crowd around their common point.
  std::unordered_set<std::uint64_t> occupied;
  for (const Vec3 p :
       find_thin_wall_midpoints(model, bvh, spacing, 2 * static_cast<double>(radius), kMinCosine)) {
    const Vec3 at = (p - grid.origin) / grid.cell;
    if (bvh.is_split && !occupied.insert(half_cell_key(at)).second) continue;
    // A wall inside a thick part is hidden: the distances there are larger.
    const Int3 nearest{static_cast<int>(at.x + 0.5f), static_cast<int>(at.y + 0.5f),
                       static_cast<int>(at.z + 0.5f)};
    if (distances.values[array3_index(grid.points, nearest)] < 2 * radius)
      layers[static_cast<std::size_t>(nearest.z)].push_back(at);
  }
  return layers;
}

/// Raises the values of all points within `max_distance` of the midpoints to f(distance).
template <class F>
void raise_around(const std::vector<std::vector<Vec3>>& midpoints, float max_distance, const F& f,
                  DistanceGrid& distances) {
  const Int3 n = distances.grid.points;
  const float cell = distances.grid.cell;
  const int cells = static_cast<int>(std::floor(max_distance / cell)) + 1;
  const auto range = [&](int at, int points) {
    return std::pair(std::max(at - cells, 0), std::min(at + cells, points - 1));
  };
  parallel_for(n.z, [&](std::int64_t layer) {
    const int z = static_cast<int>(layer);
    const auto [first_z, last_z] = range(z, n.z);
    for (int k = first_z; k <= last_z; ++k)
      for (const Vec3 at : midpoints[static_cast<std::size_t>(k)]) {
        const auto [first_y, last_y] = range(static_cast<int>(at.y), n.y);
        const auto [first_x, last_x] = range(static_cast<int>(at.x), n.x);
        for (int y = first_y; y <= last_y; ++y)
          for (int x = first_x; x <= last_x; ++x) {
            const float distance = cell * length(to_vector(x, y, z) - at);
            if (distance > max_distance) continue;
            float& v = distances.values[array3_index(n, x, y, z)];
            v = std::max(v, f(distance));
          }
      }
  });
}

double count_inside(const DistanceGrid& distances) {
  return static_cast<double>(std::count_if(distances.values.begin(), distances.values.end(),
                                           [](float v) { return v > 0; }));
}

}  // namespace

void smooth_thin_parts(const Model& model, float thinnest, DistanceGrid& distances) {
  // Standard deviation of the filter in units of `thinnest`; it thins parts, which kThickening
  // makes up for.
  constexpr float kSmoothing = 0.65f;
  const float radius = kThickening * thinnest, sigma = kSmoothing * thinnest;
  const float cell = distances.grid.cell;
  const std::vector<std::vector<Vec3>> walls = find_thin_walls(model, distances, radius);
  // Outside the thickened part the slope is doubled, to join the original distances sooner.
  const auto ball_value = [&](float distance) {
    return distance < radius ? radius - distance : 2 * (radius - distance);
  };
  const double inside_before = count_inside(distances);
  raise_around(walls, 2 * radius, ball_value, distances);
  // During a morph thin parts become thinner still, and cells would show them as rows of beads.
  // With steeper distances they appear and vanish at once. Distances stay as they are if thin parts
  // are a large part of the object, such as a spider's legs: if thickening adds more than
  // kMaxVolumeGain times its volume.
  constexpr double kMaxSteepness = 3, kMaxVolumeGain = 0.03;
  const double volume_gain = inside_before > 0 ? count_inside(distances) / inside_before - 1 : 1;
  const double rarity = std::clamp(1 - volume_gain / kMaxVolumeGain, 0.0, 1.0);
  const auto steepness = static_cast<float>(1 + (kMaxSteepness - 1) * rarity);
  if (steepness > 1)
    raise_around(
        walls, radius, [&](float distance) { return steepness * (radius - distance); }, distances);
  // Filter fully up to the distance `near` from ridges, and with a weight that falls to 0 at `far`.
  const float near = 1.5f * radius, far = 2.5f * radius;
  const std::vector<std::uint16_t> squares =
      squared_ridge_distances(distances, radius, static_cast<int>(std::floor(far / cell)) + 1);
  const float far2 = far * far / (cell * cell);
  if (std::none_of(squares.begin(), squares.end(),
                   [&](std::uint16_t square) { return static_cast<float>(square) < 1.01f * far2; }))
    return;  // no point is near a ridge; 1 % for rounding
  const auto falloff = [&](float distance) {
    const float t = std::clamp((far - distance) / (far - near), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
  };
  std::vector<float> filtered = distances.values;
  filter_gaussian(distances.grid.points, sigma / cell, filtered);
  parallel_for(
      static_cast<std::int64_t>(squares.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        const float weight = falloff(cell * std::sqrt(static_cast<float>(squares[i])));
        distances.values[i] += weight * (filtered[i] - distances.values[i]);
      },
      /*grain=*/4096);
}

}  // namespace polymorph
