#include "model/repair/voxels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace polymorph {
namespace {

constexpr float kInfiniteDistance = std::numeric_limits<float>::infinity();
constexpr float kHalfDiagonal = 0.87f;  // half the diagonal of a cube of edge 1, rounded up

/// One-dimensional squared distance transform: replaces the values f(i) of a line by min over j of
/// f(j) + (i - j)^2, the lower envelope of parabolas.
class LineTransform {
 public:
  explicit LineTransform(std::size_t n) : values_(n), vertices_(n), starts_(n + 1) {}
  void apply(float* line, std::size_t n, std::size_t stride) {
    // First builds the envelope from left to right, then evaluates it.
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double f = static_cast<double>(line[i * stride]);
      values_[i] = f;
      if (std::isinf(f)) continue;
      double start = -INFINITY;
      while (count > 0) {
        start = intersection(vertices_[count - 1], i);
        if (start > starts_[count - 1]) break;
        --count;
        start = -INFINITY;
      }
      vertices_[count] = i;
      starts_[count++] = start;
    }
    if (count == 0) return;
    std::size_t k = 0;
    for (std::size_t i = 0; i < n; ++i) {
      while (k + 1 < count && starts_[k + 1] < static_cast<double>(i)) ++k;
      const double d = static_cast<double>(i) - static_cast<double>(vertices_[k]);
      line[i * stride] = static_cast<float>(values_[vertices_[k]] + d * d);
    }
  }

 private:
  /// Position at which the parabolas of a and b intersect.
  double intersection(std::size_t a, std::size_t b) const {
    const double x = static_cast<double>(a), y = static_cast<double>(b);
    return ((values_[b] + y * y) - (values_[a] + x * x)) / (2 * (y - x));
  }
  std::vector<double> values_;         ///< f
  std::vector<std::size_t> vertices_;  ///< j of each parabola of the envelope, from left to right
  std::vector<double> starts_;         ///< position at which each of these becomes the lowest
};

/// Applies a LineTransform to all lines along an axis. Line i begins at the point whose coordinates
/// along the two other axes b and c are i % n[b] and i / n[b].
void transform_axis(const Grid& grid, int axis, std::vector<float>& distance2) {
  const std::array<std::size_t, 3> n{static_cast<std::size_t>(grid.points.x),
                                     static_cast<std::size_t>(grid.points.y),
                                     static_cast<std::size_t>(grid.points.z)};
  const std::array<std::size_t, 3> stride{1, n[0], n[0] * n[1]};
  const std::size_t a = static_cast<std::size_t>(axis), b = (a + 1) % 3, c = (a + 2) % 3;
  parallel_ranges(
      static_cast<std::int64_t>(n[b] * n[c]), /*grain=*/64,
      [&](std::int64_t begin, std::int64_t end) {
        LineTransform line(n[a]);
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          line.apply(&distance2[i % n[b] * stride[b] + i / n[b] * stride[c]], n[a], stride[a]);
      });
}

/// Calls f(index) for the neighbours of point i along the axes that lie within the grid.
template <class F>
void for_each_neighbor(const Grid& grid, std::size_t i, const F& f) {
  const auto nx = static_cast<std::size_t>(grid.points.x),
             ny = static_cast<std::size_t>(grid.points.y),
             nz = static_cast<std::size_t>(grid.points.z);
  const std::size_t x = i % nx, y = i / nx % ny, z = i / (nx * ny);
  if (x > 0) f(i - 1);
  if (x + 1 < nx) f(i + 1);
  if (y > 0) f(i - nx);
  if (y + 1 < ny) f(i + nx);
  if (z > 0) f(i - nx * ny);
  if (z + 1 < nz) f(i + nx * ny);
}

/// Tests whether the corners in `set` (bit x + 2 y + 4 z) are connected along the cube's edges.
bool is_connected(unsigned set) {
  if (set == 0) return true;
  unsigned reached = set & (0u - set);  // the lowest corner
  for (unsigned previous = 0; reached != previous;) {
    previous = reached;
    // Neighbours along x, y and z; 0x55, 0x33 and 0x0f are the corners with x, y or z = 0.
    reached |= ((reached & 0x55u) << 1) | ((reached & 0xaau) >> 1) | ((reached & 0x33u) << 2) |
               ((reached & 0xccu) >> 2) | ((reached & 0x0fu) << 4) | ((reached & 0xf0u) >> 4);
    reached &= set;
  }
  return reached == set;
}

/// Access to the eight corners of a cell, which is given by the index of its lowest corner.
struct Cells {
  const Voxels& voxels;
  std::size_t nx = static_cast<std::size_t>(voxels.grid.points.x);
  std::size_t ny = static_cast<std::size_t>(voxels.grid.points.y);
  std::size_t corner(std::size_t first, unsigned k) const {
    return first + (k & 1) + (k >> 1 & 1) * nx + (k >> 2) * nx * ny;
  }
  unsigned solid_corners(std::size_t first) const {
    unsigned set = 0;
    for (unsigned k = 0; k < 8; ++k)
      set |= static_cast<unsigned>(voxels.solid[corner(first, k)]) << k;
    return set;
  }
};

void remove_small_components(Voxels& voxels) {
  std::vector<std::uint32_t> component(voxels.count(), kNoIndex);
  std::vector<std::size_t> sizes, stack;
  for (std::size_t i = 0; i < voxels.count(); ++i) {
    if (!voxels.solid[i] || component[i] != kNoIndex) continue;
    const auto index = static_cast<std::uint32_t>(sizes.size());
    sizes.push_back(0);
    component[i] = index;
    stack.push_back(i);
    while (!stack.empty()) {
      const std::size_t current = stack.back();
      stack.pop_back();
      ++sizes.back();
      for_each_neighbor(voxels.grid, current, [&](std::size_t n) {
        if (!voxels.solid[n] || component[n] != kNoIndex) return;
        component[n] = index;
        stack.push_back(n);
      });
    }
  }
  if (sizes.empty()) return;
  const std::size_t min_size = *std::max_element(sizes.begin(), sizes.end()) / 1000 + 1;
  for (std::size_t i = 0; i < voxels.count(); ++i)
    if (voxels.solid[i] && sizes[component[i]] < min_size) voxels.solid[i] = 0;
}

}  // namespace

std::vector<float> compute_distances(const Grid& grid, const std::vector<std::uint8_t>& seed) {
  std::vector<float> distance2(seed.size());
  for (std::size_t i = 0; i < seed.size(); ++i) distance2[i] = seed[i] ? 0 : kInfiniteDistance;
  for (int axis = 0; axis < 3; ++axis) transform_axis(grid, axis, distance2);
  for (float& d : distance2) d = std::sqrt(d);
  return distance2;
}

Grid make_grid_around(const Box& box, float cell, float radius) {
  // The border must be free: its points must be further from the model than the radius plus half a
  // cell's diagonal (mark_wall_points()). 4 cells leave some to spare.
  const float margin = radius + 4 * cell;
  const auto count = [&](float size) {
    return static_cast<int>(std::ceil((size + 2 * margin) / cell)) + 1;
  };
  const Vec3 size = box.size();
  return {
      box.low - Vec3{margin, margin, margin}, cell, {count(size.x), count(size.y), count(size.z)}};
}

std::vector<std::uint8_t> mark_wall_points(const Grid& grid, const ClosestPointQuery& surface) {
  constexpr int kBlock = 8;  // points per side of a block; most blocks are skipped by one query
  std::vector<std::uint8_t> wall(array3_count(grid.points), 0);
  const auto blocks = [](int n) { return (n + kBlock - 1) / kBlock; };
  const int bx = blocks(grid.points.x), by = blocks(grid.points.y), bz = blocks(grid.points.z);
  const float max_distance = kHalfDiagonal * grid.cell;
  const float max_block_distance = max_distance + kHalfDiagonal * grid.cell * kBlock;
  parallel_for(static_cast<std::int64_t>(bx) * by * bz, [&](std::int64_t b) {
    const Int3 low{static_cast<int>(b % bx) * kBlock, static_cast<int>(b / bx % by) * kBlock,
                   static_cast<int>(b / bx / by) * kBlock};
    const Vec3 middle =
        grid_point(grid, {low.x + kBlock / 2, low.y + kBlock / 2, low.z + kBlock / 2});
    // If the surface is further than that from the block's middle, the block has no wall points.
    if (surface.closest(middle, max_block_distance).triangle == ClosestPoint::kNoTriangle) return;
    for (int z = low.z; z < std::min(low.z + kBlock, grid.points.z); ++z)
      for (int y = low.y; y < std::min(low.y + kBlock, grid.points.y); ++y)
        for (int x = low.x; x < std::min(low.x + kBlock, grid.points.x); ++x) {
          const ClosestPoint nearest = surface.closest(grid_point(grid, {x, y, z}), max_distance);
          if (nearest.triangle == ClosestPoint::kNoTriangle) continue;
          wall[array3_index(grid.points, x, y, z)] = 1;
        }
  });
  return wall;
}

Voxels find_unreachable(const Grid& grid, const std::vector<float>& wall_distances, float radius) {
  Voxels voxels{grid, /*depth=*/{}, /*solid=*/{}};
  const float radius_cells = radius / grid.cell;
  std::vector<std::uint8_t> is_reached(wall_distances.size(), 0);
  // The border is free (make_grid_around), so all of it can be reached from its first point.
  std::vector<std::size_t> stack{0};
  is_reached[0] = 1;
  while (!stack.empty()) {
    const std::size_t current = stack.back();
    stack.pop_back();
    for_each_neighbor(grid, current, [&](std::size_t n) {
      if (is_reached[n] || wall_distances[n] <= radius_cells) return;
      is_reached[n] = 1;
      stack.push_back(n);
    });
  }
  // The ball around a reached point covers all points within the radius. The extra cell erodes the
  // solid.
  voxels.depth = compute_distances(grid, is_reached);
  voxels.solid.resize(voxels.depth.size());
  for (std::size_t i = 0; i < voxels.depth.size(); ++i) {
    voxels.depth[i] -= radius_cells + 1;
    voxels.solid[i] = voxels.depth[i] > 0 ? 1 : 0;
  }
  return voxels;
}

void make_manifold(Voxels& voxels) {
  remove_small_components(voxels);
  const Cells cells{voxels};
  const Int3 n = voxels.grid.points;
  for (bool changed = true; changed;) {
    changed = false;
    for (int z = 0; z + 1 < n.z; ++z)
      for (int y = 0; y + 1 < n.y; ++y)
        for (int x = 0; x + 1 < n.x; ++x) {
          const std::size_t first = voxels.index(x, y, z);
          for (;;) {
            const unsigned set = cells.solid_corners(first);
            if (is_connected(set) && is_connected(~set & 0xffu)) break;
            // The innermost empty corner becomes solid.
            std::size_t best = 0;
            float max_depth = -kInfiniteDistance;
            for (unsigned k = 0; k < 8; ++k) {
              const std::size_t corner = cells.corner(first, k);
              if (voxels.solid[corner] || !(voxels.depth[corner] > max_depth)) continue;
              max_depth = voxels.depth[corner];
              best = corner;
            }
            voxels.solid[best] = 1;
            changed = true;
          }
        }
  }
}

VoxelSurface make_surface_nets(const Voxels& voxels) {
  const Cells cells{voxels};
  const Int3 n = voxels.grid.points;
  VoxelSurface surface;
  std::vector<std::uint32_t> vertex(voxels.count(), kNoIndex);  // per cell, by its lowest corner
  // make_manifold() changes `solid` but not `depth`, so the sign of the depth may be wrong. The
  // depth is clamped to at least 0.01 cells on the right side of 0, so that the crossing below is
  // well defined.
  const auto clamped_depth = [&](std::size_t i) {
    return voxels.solid[i] ? std::max(voxels.depth[i], 0.01f) : std::min(voxels.depth[i], -0.01f);
  };
  for (int z = 0; z + 1 < n.z; ++z)
    for (int y = 0; y + 1 < n.y; ++y)
      for (int x = 0; x + 1 < n.x; ++x) {
        const std::size_t first = voxels.index(x, y, z);
        const unsigned set = cells.solid_corners(first);
        if (set == 0 || set == 0xff) continue;
        // The vertex is the mean of the crossings with the cell's edges.
        Vec3 sum;
        float count = 0;
        for (unsigned a = 0; a < 8; ++a)
          for (const unsigned step : {1u, 2u, 4u}) {
            const unsigned b = a | step;
            if (b == a || (set >> a & 1) == (set >> b & 1)) continue;
            const float depth_a = clamped_depth(cells.corner(first, a)),
                        depth_b = clamped_depth(cells.corner(first, b));
            const float t = depth_a / (depth_a - depth_b);  // where the depth is 0
            sum =
                sum +
                Vec3{static_cast<float>(a & 1), static_cast<float>(a >> 1 & 1),
                     static_cast<float>(a >> 2)} +
                t * Vec3{step == 1 ? 1.0f : 0.0f, step == 2 ? 1.0f : 0.0f, step == 4 ? 1.0f : 0.0f};
            count += 1;
          }
        vertex[first] = static_cast<std::uint32_t>(surface.points.size());
        surface.points.push_back(grid_point(voxels.grid, {x, y, z}) +
                                 (sum / count) * voxels.grid.cell);
      }
  // A quad joins the vertices of the four cells around an edge.
  const std::array<std::size_t, 3> stride{1, cells.nx, cells.nx * cells.ny};
  for (int z = 1; z + 1 < n.z; ++z)
    for (int y = 1; y + 1 < n.y; ++y)
      for (int x = 1; x + 1 < n.x; ++x) {
        const std::size_t i = voxels.index(x, y, z);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (voxels.solid[i] == voxels.solid[i + stride[axis]]) continue;
          const std::size_t u = stride[(axis + 1) % 3], v = stride[(axis + 2) % 3];
          // The quad is counter-clockwise as seen from the edge's upper end. If the lower end is
          // empty, its order is reversed, so that it faces outward.
          std::array<std::uint32_t, 4> q{vertex[i - u - v], vertex[i - v], vertex[i],
                                         vertex[i - u]};
          if (!voxels.solid[i]) std::swap(q[1], q[3]);
          surface.triangles.push_back({{q[0], q[1], q[2]}});
          surface.triangles.push_back({{q[0], q[2], q[3]}});
        }
      }
  return surface;
}

}  // namespace polymorph
