#include "morph/voxel_solid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/parallel.h"
#include "base/result.h"
#include "kernels/simd_math.h"

namespace polymorph {
namespace {

/// A step to one of the 26 neighbours. It is 12 units long along an axis, 17 along a face's
/// diagonal and 21 along a cube's, within 1.1 % of the exact lengths. Distances in other directions
/// are longer (geodesic_distances(); chamfer distances, Borgefors 1986).
struct Step {
  Int3 offset;
  std::uint8_t length = 0;
};
std::array<Step, 26> neighbor_steps() {
  constexpr std::array<std::uint8_t, 4> kLengths{0, VoxelSolid::kStepUnits, 17, 21};
  std::array<Step, 26> steps;
  std::size_t n = 0;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) {
        const auto axes = static_cast<std::size_t>(std::abs(x) + std::abs(y) + std::abs(z));
        if (axes > 0) steps[n++] = {{x, y, z}, kLengths[axes]};
      }
  return steps;
}

/// Tests whether grid coordinates are in the grid.
bool holds(const Grid& grid, Int3 p) {
  return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < grid.points.x && p.y < grid.points.y &&
         p.z < grid.points.z;
}
std::uint32_t flat_index(const Grid& grid, Int3 p) {
  return static_cast<std::uint32_t>(p.x + grid.points.x * (p.y + grid.points.y * p.z));
}
Int3 grid_coordinates(const Grid& grid, std::uint32_t index) {
  const int i = static_cast<int>(index);
  return {i % grid.points.x, i / grid.points.x % grid.points.y, i / grid.points.x / grid.points.y};
}
Int3 offset_by(Int3 p, Int3 offset) { return {p.x + offset.x, p.y + offset.y, p.z + offset.z}; }

/// Half the extent of the box around the points where a ball's exponent w - a d^T shape d, with the
/// offset d from its centre, is above -`margin`.
Vec3 half_extent(const Ball& ball, float margin) {
  const Sym3& s = ball.shape;
  const float radius = std::sqrt(std::max(ball.w + margin, 0.0f) / ball.a);
  const auto half_side = [&](float p, float q, float r) {
    // A diagonal element of the inverse of `shape`, whose determinant is 1.
    return radius * std::sqrt(std::max(p * q - r * r, 0.0f));
  };
  return {half_side(s.yy, s.zz, s.yz), half_side(s.xx, s.zz, s.xz), half_side(s.xx, s.yy, s.xy)};
}

/// Makes the grid around the balls, with `cells` cells along its longest side. Its cell size is 0
/// if the box around the balls is a point.
Grid grid_over(const std::vector<Ball>& balls, int cells) {
  // The box holds all points where a single ball's value is at least exp(-0.05).
  constexpr float kExponentMargin = 0.05f;
  constexpr int kMargin = 2;  // grid points beyond the box on each side
  Vec3 low = balls[0].center, high = low;
  for (const Ball& ball : balls) {
    const Vec3 half = half_extent(ball, kExponentMargin);
    low = min(low, ball.center - half);
    high = max(high, ball.center + half);
  }
  const Vec3 size = high - low;
  Grid grid;
  grid.cell = std::max({size.x, size.y, size.z}) / static_cast<float>(cells);
  if (!(grid.cell > 0)) return grid;
  const auto points = [&](float extent) {
    return static_cast<int>(std::ceil(extent / grid.cell)) + 2 * kMargin + 1;
  };
  grid.points = {points(size.x), points(size.y), points(size.z)};
  grid.origin = low - Vec3{kMargin, kMargin, kMargin} * grid.cell;
  return grid;
}

/// Marks the points of the grid at which the field is at least 1.
std::vector<std::uint8_t> mark_inside(const std::vector<Ball>& balls, const Grid& grid) {
  // A ball is ignored where its value is below exp(-kTail).
  constexpr float kTail = 6, kLog2E = 1.44269504f;
  const auto plane =
      static_cast<std::size_t>(grid.points.x) * static_cast<std::size_t>(grid.points.y);
  std::vector<std::uint8_t> inside(plane * static_cast<std::size_t>(grid.points.z), 0);
  std::vector<Vec3> half;
  for (const Ball& ball : balls) half.push_back(half_extent(ball, kTail));
  // First and last grid point of a ball's box along an axis; first > last if none is in the grid.
  const auto range = [&](float center, float half_size, float origin, int points) {
    const float low = (center - half_size - origin) / grid.cell,
                high = (center + half_size - origin) / grid.cell;
    const float last = static_cast<float>(points - 1);
    return std::pair(static_cast<int>(std::ceil(std::clamp(low, 0.0f, last + 1))),
                     static_cast<int>(std::floor(std::clamp(high, -1.0f, last))));
  };
  parallel_for(grid.points.z, [&](std::int64_t z) {
    std::vector<float> field(plane, 0);
    for (std::size_t b = 0; b < balls.size(); ++b) {
      const Ball& ball = balls[b];
      const float dz = grid.origin.z + grid.cell * static_cast<float>(z) - ball.center.z;
      if (std::fabs(dz) > half[b].z) continue;
      const auto [x0, x1] = range(ball.center.x, half[b].x, grid.origin.x, grid.points.x);
      const auto [y0, y1] = range(ball.center.y, half[b].y, grid.origin.y, grid.points.y);
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
          const Vec3 d = {grid.origin.x + grid.cell * static_cast<float>(x) - ball.center.x,
                          grid.origin.y + grid.cell * static_cast<float>(y) - ball.center.y, dz};
          const float exponent = ball.w - ball.a * quadratic(ball.shape, d);
          if (exponent > -kTail)
            field[static_cast<std::size_t>(x + grid.points.x * y)] += exp2(kLog2E * exponent);
        }
    }
    for (std::size_t i = 0; i < plane; ++i)
      inside[static_cast<std::size_t>(z) * plane + i] = field[i] >= 1 ? 1 : 0;
  });
  return inside;
}

/// Finds the connected components of the points inside, in the order of their first points.
std::vector<std::vector<std::uint32_t>> find_components(const Grid& grid,
                                                        const std::vector<std::uint8_t>& inside) {
  const std::array<Step, 26> steps = neighbor_steps();
  std::vector<std::uint8_t> visited(inside.size(), 0);
  std::vector<std::vector<std::uint32_t>> components;
  for (std::uint32_t start = 0; start < inside.size(); ++start) {
    if (!inside[start] || visited[start]) continue;
    std::vector<std::uint32_t> members{start};
    visited[start] = 1;
    for (std::size_t k = 0; k < members.size(); ++k)
      for (const Step& step : steps) {
        const Int3 p = offset_by(grid_coordinates(grid, members[k]), step.offset);
        if (!holds(grid, p)) continue;
        const std::uint32_t to = flat_index(grid, p);
        if (inside[to] && !visited[to]) visited[to] = 1, members.push_back(to);
      }
    std::sort(members.begin(), members.end());
    components.push_back(std::move(members));
  }
  return components;
}

/// Lists the members with a point outside among their 6 neighbours. Only these can be nearest to
/// another component.
std::vector<std::uint32_t> find_border(const Grid& grid, const std::vector<std::uint8_t>& inside,
                                       const std::vector<std::uint32_t>& members) {
  std::vector<std::uint32_t> border;
  for (const std::uint32_t member : members) {
    const Int3 p = grid_coordinates(grid, member);
    for (const Int3 neighbor :
         {Int3{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}})
      if (const Int3 q = offset_by(p, neighbor); !holds(grid, q) || !inside[flat_index(grid, q)]) {
        border.push_back(member);
        break;
      }
  }
  return border;
}

/// Adds the grid points on the straight line between two members.
void add_line(const Grid& grid, Int3 a, Int3 b, std::vector<std::uint8_t>& inside,
              std::vector<std::uint32_t>& members) {
  const Int3 difference{b.x - a.x, b.y - a.y, b.z - a.z};
  const int count =
      std::max({std::abs(difference.x), std::abs(difference.y), std::abs(difference.z)});
  const auto coordinate = [&](int from, int extent, int i) {
    return from + (2 * extent * i + (extent < 0 ? -count : count)) / (2 * count);  // rounded
  };
  for (int i = 1; i < count; ++i) {
    const std::uint32_t to =
        flat_index(grid, {coordinate(a.x, difference.x, i), coordinate(a.y, difference.y, i),
                          coordinate(a.z, difference.z, i)});
    if (!inside[to]) inside[to] = 1, members.push_back(to);
  }
}

/// Removes tiny components. Then connects the smallest component to the nearest one until a single
/// component is left.
void join_components(const Grid& grid, std::vector<std::uint8_t>& inside) {
  auto components = find_components(grid, inside);
  std::size_t count = 0;
  for (const auto& members : components) count += members.size();
  // Components of fewer than 4 voxels, or than 1/5000 of all, are removed.
  const std::size_t min_count = std::max<std::size_t>(4, count / 5000);
  std::erase_if(components, [&](const std::vector<std::uint32_t>& members) {
    if (members.size() >= min_count) return false;
    for (const std::uint32_t member : members) inside[member] = 0;
    return true;
  });
  while (components.size() > 1) {
    const auto smallest =
        std::min_element(components.begin(), components.end(),
                         [](const auto& a, const auto& b) { return a.size() < b.size(); });
    // Find its voxel and the other component's voxel that are nearest to each other.
    const std::vector<std::uint32_t> own_border = find_border(grid, inside, *smallest);
    std::vector<Int3> own_coordinates;
    for (const std::uint32_t voxel : own_border)
      own_coordinates.push_back(grid_coordinates(grid, voxel));
    std::int64_t nearest = std::numeric_limits<std::int64_t>::max();
    std::uint32_t from = 0, to = 0;
    std::size_t partner = 0;
    for (std::size_t k = 0; k < components.size(); ++k) {
      if (components.begin() + static_cast<std::ptrdiff_t>(k) == smallest) continue;
      for (const std::uint32_t other : find_border(grid, inside, components[k])) {
        const Int3 q = grid_coordinates(grid, other);
        for (std::size_t i = 0; i < own_border.size(); ++i) {
          const Int3 p = own_coordinates[i];
          const std::int64_t dx = p.x - q.x, dy = p.y - q.y, dz = p.z - q.z;
          const std::int64_t distance2 = dx * dx + dy * dy + dz * dz;
          if (distance2 < nearest)
            nearest = distance2, from = own_border[i], to = other, partner = k;
        }
      }
    }
    // Connect them by a line, and join the components.
    auto& partner_members = components[partner];
    add_line(grid, grid_coordinates(grid, from), grid_coordinates(grid, to), inside,
             partner_members);
    partner_members.insert(partner_members.end(), smallest->begin(), smallest->end());
    components.erase(smallest);
  }
}

/// Numbers the voxels in the order of the grid and lists their neighbours.
void number_voxels(VoxelSolid& solid, const std::vector<std::uint8_t>& inside) {
  solid.voxels.assign(inside.size(), VoxelSolid::kNone);
  for (std::uint32_t i = 0; i < inside.size(); ++i)
    if (inside[i]) {
      solid.voxels[i] = static_cast<std::uint32_t>(solid.grid_indices.size());
      solid.grid_indices.push_back(i);
    }
  solid.first_neighbor.push_back(0);
  const std::array<Step, 26> steps = neighbor_steps();
  for (std::uint32_t i = 0; i < solid.size(); ++i) {
    const Int3 p = solid.point(i);
    for (const Step& step : steps) {
      const Int3 q = offset_by(p, step.offset);
      if (!holds(solid.grid, q) || !inside[flat_index(solid.grid, q)]) continue;
      solid.neighbors.push_back(solid.voxels[flat_index(solid.grid, q)]);
      solid.steps.push_back(step.length);
    }
    solid.first_neighbor.push_back(static_cast<std::uint32_t>(solid.neighbors.size()));
  }
}

constexpr std::uint32_t kFar = std::numeric_limits<std::uint32_t>::max();

/// Completes distances from the known ones, which are not kFar, by Dial's algorithm (1969). It is
/// Dijkstra's algorithm with a cyclic array of buckets, one per distance.
void propagate_distances(const VoxelSolid& solid, std::vector<std::uint32_t>& distance) {
  constexpr std::uint32_t kBuckets = 32;  // more than the longest step (21)
  std::array<std::vector<std::uint32_t>, kBuckets> buckets;
  std::size_t queued_count = 0;
  std::uint32_t low = kFar, high = 0;
  for (const std::uint32_t d : distance)
    if (d != kFar) low = std::min(low, d), high = std::max(high, d);
  PM_CHECK(low == kFar || high - low < kBuckets);
  for (std::uint32_t i = 0; i < distance.size(); ++i)
    if (distance[i] != kFar) buckets[distance[i] % kBuckets].push_back(i), ++queued_count;
  for (std::uint32_t d = low; queued_count > 0; ++d) {
    std::vector<std::uint32_t>& bucket = buckets[d % kBuckets];
    // Steps are longer than 0 and shorter than the number of buckets, so this bucket does not grow.
    for (const std::uint32_t i : bucket) {
      --queued_count;
      if (distance[i] != d) continue;
      for (std::uint32_t k = solid.first_neighbor[i]; k < solid.first_neighbor[i + 1]; ++k) {
        const std::uint32_t to = solid.neighbors[k], new_distance = d + solid.steps[k];
        if (new_distance >= distance[to]) continue;
        distance[to] = new_distance;
        buckets[new_distance % kBuckets].push_back(to);
        ++queued_count;
      }
    }
    bucket.clear();
  }
}

void measure_depth(VoxelSolid& solid) {
  const std::array<Step, 26> steps = neighbor_steps();
  solid.depth.assign(solid.size(), kFar);
  for (std::uint32_t i = 0; i < solid.size(); ++i)
    for (const Step& step : steps) {
      const Int3 q = offset_by(solid.point(i), step.offset);
      if (!holds(solid.grid, q) || solid.voxels[flat_index(solid.grid, q)] == VoxelSolid::kNone)
        solid.depth[i] = std::min<std::uint32_t>(solid.depth[i], step.length);
    }
  propagate_distances(solid, solid.depth);
}

/// The voxel that contains `place` (Vec3 or Vec3d), or kNone.
template <class Place>
std::uint32_t voxel_at(const VoxelSolid& solid, Place place) {
  using T = decltype(place.x);
  const auto rounded = [&](T x, float origin) {
    return static_cast<int>(
        std::floor((x - static_cast<T>(origin)) / static_cast<T>(solid.grid.cell) + T(0.5)));
  };
  const Int3 p = {rounded(place.x, solid.grid.origin.x), rounded(place.y, solid.grid.origin.y),
                  rounded(place.z, solid.grid.origin.z)};
  return holds(solid.grid, p) ? solid.voxels[flat_index(solid.grid, p)] : VoxelSolid::kNone;
}

}  // namespace

Int3 VoxelSolid::point(std::uint32_t i) const { return grid_coordinates(grid, grid_indices[i]); }
Vec3d VoxelSolid::center(std::uint32_t i) const { return Vec3d(grid_point(grid, point(i))); }

bool VoxelSolid::contains(Vec3d place) const { return voxel_at(*this, place) != kNone; }

VoxelSolid voxel_solid(const std::vector<Ball>& balls) {
  // The number of voxels on a coarse grid gives the cell size for about kTargetCount voxels.
  constexpr int kMin = 24, kCoarse = 48, kFine = 96;  // cells along the longest side
  constexpr double kTargetCount = 20000;              // voxels
  VoxelSolid solid;
  solid.grid = grid_over(balls, kCoarse);
  if (!(solid.grid.cell > 0)) return solid;
  std::vector<std::uint8_t> inside = mark_inside(balls, solid.grid);
  const double count = std::accumulate(inside.begin(), inside.end(), 0.0);
  if (!(count > 0)) return solid;
  const int cells =
      std::clamp(static_cast<int>(kCoarse * cube_root(kTargetCount / count)), kMin, kFine);
  if (cells != kCoarse) {
    solid.grid = grid_over(balls, cells);
    inside = mark_inside(balls, solid.grid);
  }
  join_components(solid.grid, inside);
  number_voxels(solid, inside);
  measure_depth(solid);
  return solid;
}

std::vector<std::uint32_t> geodesic_distances(const VoxelSolid& solid,
                                              std::span<const std::uint32_t> sources) {
  std::vector<std::uint32_t> distance(solid.size(), kFar);
  for (const std::uint32_t source : sources) distance[source] = 0;
  propagate_distances(solid, distance);
  return distance;
}

std::vector<std::uint32_t> local_radii(const VoxelSolid& solid) {
  // Balls are placed at the local maxima of the depth, the largest first. A ball whose centre lies
  // in a ball that is kSkipRatio times as large is skipped. kHalfDiagonal, half a voxel's diagonal
  // in voxels, is added to the radii, so that balls cover the voxels at the surface.
  constexpr double kSkipRatio = 1.3, kHalfDiagonal = 0.87;
  std::vector<std::uint32_t> centers;
  for (std::uint32_t i = 0; i < solid.size(); ++i) {
    bool is_deepest = true;
    for (std::uint32_t k = solid.first_neighbor[i]; k < solid.first_neighbor[i + 1]; ++k)
      is_deepest &= solid.depth[i] >= solid.depth[solid.neighbors[k]];
    if (is_deepest) centers.push_back(i);
  }
  std::stable_sort(centers.begin(), centers.end(), [&](std::uint32_t i, std::uint32_t j) {
    return solid.depth[i] > solid.depth[j];
  });
  std::vector<std::uint32_t> radius(solid.size(), 0);
  for (const std::uint32_t i : centers) {
    const std::uint32_t depth = solid.depth[i];
    if (static_cast<double>(radius[i]) >= kSkipRatio * depth) continue;
    const double ball_radius = static_cast<double>(depth) / VoxelSolid::kStepUnits + kHalfDiagonal;
    const int r = static_cast<int>(ball_radius);
    const Int3 center = solid.point(i);
    for (int z = -r; z <= r; ++z)
      for (int y = -r; y <= r; ++y)
        for (int x = -r; x <= r; ++x) {
          const Int3 p = offset_by(center, {x, y, z});
          if (x * x + y * y + z * z > ball_radius * ball_radius || !holds(solid.grid, p)) continue;
          const std::uint32_t to = solid.voxels[flat_index(solid.grid, p)];
          if (to != VoxelSolid::kNone && radius[to] == 0) radius[to] = depth;
        }
  }
  for (std::uint32_t i = 0; i < solid.size(); ++i)
    if (radius[i] == 0) radius[i] = solid.depth[i];
  return radius;
}

std::uint32_t nearest_voxel(const VoxelSolid& solid, Vec3 place) {
  if (const std::uint32_t i = voxel_at(solid, place); i != VoxelSolid::kNone) return i;
  std::uint32_t nearest = 0;
  float shortest = std::numeric_limits<float>::infinity();
  for (std::uint32_t i = 0; i < solid.size(); ++i) {
    const Vec3 d = grid_point(solid.grid, solid.point(i)) - place;
    if (dot(d, d) < shortest) shortest = dot(d, d), nearest = i;
  }
  return nearest;
}

}  // namespace polymorph
