#include "field/thinness.h"

#include <algorithm>
#include <cmath>

#include "base/array3.h"
#include "base/parallel.h"

namespace polymorph {
namespace {

// Fractions of the object's size: the half thickness from which a part is not thin, the distance
// over which thinness decreases to 0, and the cell of the coarse grid.
constexpr float kThick = 0.06f, kFalloffDistance = 0.1f, kCell = 0.02f;
/// Maximum norm of the gradient on the medial axis. It is 1 next to a face, 0 between parallel
/// faces and sin(a / 2) where two faces enclose the angle a. Above 60 degrees they form an edge,
/// not a thin part.
constexpr float kMaxMedialGradient = 0.5f;

/// Makes a grid of every `stride`-th point, with `margin` more coarse cells on each side.
Grid coarse_grid(const Grid& fine, int stride, int margin) {
  Grid grid;
  grid.cell = static_cast<float>(stride) * fine.cell;
  const auto points = [&](int n) { return (n + stride - 1) / stride + 1 + 2 * margin; };
  grid.points = {points(fine.points.x), points(fine.points.y), points(fine.points.z)};
  const float width = static_cast<float>(margin) * grid.cell;
  grid.origin = fine.origin - Vec3{width, width, width};
  return grid;
}

/// Computes the thinness at the fine grid's points on the medial axis and stores the maximum at the
/// nearest coarse points.
void mark_medial_axis(const DistanceGrid& fine, float thick, int stride, int margin,
                      DistanceGrid& result) {
  const Int3 n = fine.grid.points;
  const float inv_two_cells = 0.5f / fine.grid.cell;
  const auto at = [&](int x, int y, int z) { return fine.values[array3_index(n, x, y, z)]; };
  const auto nearest = [&](int i) { return margin + (i + stride / 2) / stride; };
  // All fine layers that write to the same coarse layer are processed by one thread.
  parallel_for((n.z + stride / 2) / stride + 1, [&](std::int64_t layer) {
    const int middle = static_cast<int>(layer) * stride;
    const int first = std::max(middle - stride / 2, 1),
              end = std::min(middle - stride / 2 + stride, n.z - 1);
    for (int z = first; z < end; ++z)
      for (int y = 1; y + 1 < n.y; ++y)
        for (int x = 1; x + 1 < n.x; ++x) {
          const float h = at(x, y, z);
          if (h <= 0 || h >= thick) continue;
          const Vec3 gradient = inv_two_cells * Vec3{at(x + 1, y, z) - at(x - 1, y, z),
                                                     at(x, y + 1, z) - at(x, y - 1, z),
                                                     at(x, y, z + 1) - at(x, y, z - 1)};
          if (dot(gradient, gradient) > kMaxMedialGradient * kMaxMedialGradient) continue;
          const float relative = h / thick;
          float& v =
              result.values[array3_index(result.grid.points, nearest(x), nearest(y), nearest(z))];
          v = std::max(v, 1 - relative * relative);
        }
  });
}

/// Raises values so that none is below a neighbour's by more than `max_fall` per cell of distance:
/// a chamfer distance transform (Borgefors 1986), forward and backward.
void dilate(float max_fall, DistanceGrid& result) {
  const Int3 n = result.grid.points;
  struct Step {
    int x, y, z;
    float fall;
  };
  std::vector<Step> offsets;  // to the 13 neighbours that precede a point in a forward pass
  for (int z = -1; z <= 0; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (z < 0 || y < 0 || (y == 0 && x < 0))
          offsets.push_back(
              {x, y, z, max_fall * std::sqrt(static_cast<float>(x * x + y * y + z * z))});
  const auto is_in_grid = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < n.x && y < n.y && z < n.z;
  };
  const auto raise = [&](int x, int y, int z, int sign) {
    float& v = result.values[array3_index(n, x, y, z)];
    for (const Step& step : offsets) {
      const int a = x + sign * step.x, b = y + sign * step.y, c = z + sign * step.z;
      if (is_in_grid(a, b, c)) v = std::max(v, result.values[array3_index(n, a, b, c)] - step.fall);
    }
  };
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) raise(x, y, z, 1);
  for (int z = n.z - 1; z >= 0; --z)
    for (int y = n.y - 1; y >= 0; --y)
      for (int x = n.x - 1; x >= 0; --x) raise(x, y, z, -1);
}

/// Returns the mean of 1 - thinness over the coarse points inside the object; 1 if there are none.
float compute_mean_bulk(const DistanceGrid& distances, const DistanceGrid& thinness) {
  const Grid &fine = distances.grid, &grid = thinness.grid;
  const auto stride = static_cast<int>(std::lround(grid.cell / fine.cell)),
             margin = static_cast<int>(std::lround((fine.origin.x - grid.origin.x) / grid.cell));
  double bulk = 0;
  std::int64_t points = 0;
  const Int3 n = distances.grid.points;
  for (int z = 0; z < n.z; z += stride)
    for (int y = 0; y < n.y; y += stride)
      for (int x = 0; x < n.x; x += stride) {
        if (distances.values[array3_index(n, x, y, z)] <= 0) continue;
        const auto coarse = array3_index(thinness.grid.points, margin + x / stride,
                                         margin + y / stride, margin + z / stride);
        bulk += 1 - static_cast<double>(thinness.values[coarse]);
        ++points;
      }
  return points > 0 ? static_cast<float>(bulk / static_cast<double>(points)) : 1;
}

}  // namespace

DistanceGrid compute_thinness(const DistanceGrid& distances, float size) {
  const float fine = distances.grid.cell, falloff_distance = kFalloffDistance * size;
  const int stride = std::max(1, static_cast<int>(std::lround(kCell * size / fine)));
  const float cell = static_cast<float>(stride) * fine;
  const int margin = static_cast<int>(std::ceil(falloff_distance / cell)) + 1;
  DistanceGrid result;
  result.grid = coarse_grid(distances.grid, stride, margin);
  const Int3 n = result.grid.points;
  result.values.assign(array3_count(n), 0.0f);
  mark_medial_axis(distances, kThick * size, stride, margin, result);
  dilate(cell / falloff_distance, result);
  return result;
}

DistanceGrid limit_thinness(DistanceGrid thinness, const DistanceGrid& distances) {
  const float factor = std::min(2 * compute_mean_bulk(distances, thinness), 1.0f);
  for (float& v : thinness.values) v *= factor;
  return thinness;
}

}  // namespace polymorph
