#include "field/thinness.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace polymorph {
namespace {

// Shares of the object's size: half of what is not thin, how far thinness reaches, and the coarse
// grid's cells.
constexpr float kThick = 0.06f, kReach = 0.1f, kCell = 0.02f;
/// The gradient's norm is 1 beside a face, cos(a / 2) where two faces meet at an angle of a inside
/// and 0 between parallel ones: angles of more than 120 degrees are not the middle of a part.
constexpr float kFlat = 0.5f;

std::size_t index_in(const Grid& grid, int x, int y, int z) {
  return static_cast<std::size_t>(x) +
         static_cast<std::size_t>(grid.points.x) *
             (static_cast<std::size_t>(y) +
              static_cast<std::size_t>(grid.points.y) * static_cast<std::size_t>(z));
}

/// Every `per`-th point of a grid, and `margin` cells more on each side.
Grid coarse_grid(const Grid& fine, int per, int margin) {
  Grid grid;
  grid.cell = static_cast<float>(per) * fine.cell;
  const auto points = [&](int n) { return (n + per - 1) / per + 1 + 2 * margin; };
  grid.points = {points(fine.points.x), points(fine.points.y), points(fine.points.z)};
  const float before = static_cast<float>(margin) * grid.cell;
  grid.origin = fine.origin - Vec3{before, before, before};
  return grid;
}

/// The thinness of the fine grid's points on the middles of parts, at the nearest coarse points.
void mark_middles(const DistanceGrid& fine, float thick, int per, int margin, DistanceGrid& out) {
  const Int3 n = fine.grid.points;
  const float per_cell = 0.5f / fine.grid.cell;
  const auto at = [&](int x, int y, int z) { return fine.values[index_in(fine.grid, x, y, z)]; };
  const auto nearest = [&](int i) { return margin + (i + per / 2) / per; };
  // The layers that share a coarse layer go to one thread.
  parallel_for((n.z + per / 2) / per + 1, [&](std::int64_t layer) {
    const int middle = static_cast<int>(layer) * per;
    const int first = std::max(middle - per / 2, 1),
              end = std::min(middle - per / 2 + per, n.z - 1);
    for (int z = first; z < end; ++z)
      for (int y = 1; y + 1 < n.y; ++y)
        for (int x = 1; x + 1 < n.x; ++x) {
          const float h = at(x, y, z);
          if (h <= 0 || h >= thick) continue;
          const Vec3 gradient =
              per_cell * Vec3{at(x + 1, y, z) - at(x - 1, y, z), at(x, y + 1, z) - at(x, y - 1, z),
                              at(x, y, z + 1) - at(x, y, z - 1)};
          if (dot(gradient, gradient) > kFlat * kFlat) continue;
          const float share = h / thick;
          float& v = out.values[index_in(out.grid, nearest(x), nearest(y), nearest(z))];
          v = std::max(v, 1 - share * share);
        }
  });
}

/// Raises what lies beside larger values, so that nothing falls by more than `fall` per cell: a
/// chamfer distance transform (Borgefors 1986), forward and backward.
void spread(float fall, DistanceGrid& out) {
  const Int3 n = out.grid.points;
  struct Step {
    int x, y, z;
    float fall;
  };
  std::vector<Step> before;
  for (int z = -1; z <= 0; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (z < 0 || y < 0 || (y == 0 && x < 0))
          before.push_back({x, y, z, fall * std::sqrt(static_cast<float>(x * x + y * y + z * z))});
  const auto inside = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < n.x && y < n.y && z < n.z;
  };
  const auto raise = [&](int x, int y, int z, int way) {
    float& v = out.values[index_in(out.grid, x, y, z)];
    for (const Step& step : before) {
      const int a = x + way * step.x, b = y + way * step.y, c = z + way * step.z;
      if (inside(a, b, c)) v = std::max(v, out.values[index_in(out.grid, a, b, c)] - step.fall);
    }
  };
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) raise(x, y, z, 1);
  for (int z = n.z - 1; z >= 0; --z)
    for (int y = n.y - 1; y >= 0; --y)
      for (int x = n.x - 1; x >= 0; --x) raise(x, y, z, -1);
}

/// The mean of 1 - thinness over the coarse points in the object, 1 where there are none.
float bulk_of(const DistanceGrid& distances, int per, int margin, const DistanceGrid& out) {
  double bulk = 0;
  std::int64_t points = 0;
  const Int3 n = distances.grid.points;
  for (int z = 0; z < n.z; z += per)
    for (int y = 0; y < n.y; y += per)
      for (int x = 0; x < n.x; x += per) {
        if (distances.values[index_in(distances.grid, x, y, z)] <= 0) continue;
        const auto coarse =
            index_in(out.grid, margin + x / per, margin + y / per, margin + z / per);
        bulk += 1 - static_cast<double>(out.values[coarse]);
        ++points;
      }
  return points > 0 ? static_cast<float>(bulk / static_cast<double>(points)) : 1;
}

}  // namespace

DistanceGrid thinness(const DistanceGrid& distances, float size) {
  const float fine = distances.grid.cell, reach = kReach * size;
  const int per = std::max(1, static_cast<int>(std::lround(kCell * size / fine)));
  const float cell = static_cast<float>(per) * fine;
  const int margin = static_cast<int>(std::ceil(reach / cell)) + 1;
  DistanceGrid out;
  out.grid = coarse_grid(distances.grid, per, margin);
  const Int3 n = out.grid.points;
  out.values.assign(index_in(out.grid, n.x - 1, n.y - 1, n.z - 1) + 1, 0.0f);
  mark_middles(distances, kThick * size, per, margin, out);
  spread(cell / reach, out);
  // Something must be left for the level to move: what is thin everywhere has no thin parts.
  const float factor = std::min(2 * bulk_of(distances, per, margin, out), 1.0f);
  for (float& v : out.values) v *= factor;
  return out;
}

}  // namespace polymorph
