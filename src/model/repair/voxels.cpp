#include "model/repair/voxels.h"
#include "model/transform.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace polymorph {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kNone = 0xffffffffu;

std::size_t points_of(const Grid& grid) {
  return static_cast<std::size_t>(grid.points.x) * static_cast<std::size_t>(grid.points.y) *
         static_cast<std::size_t>(grid.points.z);
}

/// The lower envelope of parabolas over one line: squared distances along an axis are added.
class LineTransform {
 public:
  explicit LineTransform(std::size_t n) : values_(n), tops_(n), starts_(n + 1) {}
  void apply(float* line, std::size_t n, std::size_t stride) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double f = static_cast<double>(line[i * stride]);
      values_[i] = f;
      if (std::isinf(f)) continue;
      double start = -INFINITY;
      while (count > 0) {
        start = meet(tops_[count - 1], i);
        if (start > starts_[count - 1]) break;
        --count;
        start = -INFINITY;
      }
      tops_[count] = i;
      starts_[count++] = start;
    }
    if (count == 0) return;
    std::size_t k = 0;
    for (std::size_t i = 0; i < n; ++i) {
      while (k + 1 < count && starts_[k + 1] < static_cast<double>(i)) ++k;
      const double d = static_cast<double>(i) - static_cast<double>(tops_[k]);
      line[i * stride] = static_cast<float>(values_[tops_[k]] + d * d);
    }
  }

 private:
  double meet(std::size_t a, std::size_t b) const {
    const double x = static_cast<double>(a), y = static_cast<double>(b);
    return ((values_[b] + y * y) - (values_[a] + x * x)) / (2 * (y - x));
  }
  std::vector<double> values_;
  std::vector<std::size_t> tops_;
  std::vector<double> starts_;
};

void transform_axis(const Grid& grid, int axis, std::vector<float>& squared) {
  const std::array<std::size_t, 3> n{static_cast<std::size_t>(grid.points.x),
                                     static_cast<std::size_t>(grid.points.y),
                                     static_cast<std::size_t>(grid.points.z)};
  const std::array<std::size_t, 3> stride{1, n[0], n[0] * n[1]};
  const std::size_t a = static_cast<std::size_t>(axis), b = (a + 1) % 3, c = (a + 2) % 3;
  parallel_ranges(
      static_cast<std::int64_t>(n[b] * n[c]), 64, [&](std::int64_t begin, std::int64_t end) {
        LineTransform line(n[a]);
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          line.apply(&squared[i % n[b] * stride[b] + i / n[b] * stride[c]], n[a], stride[a]);
      });
}

/// Calls f(index) for the neighbours along the axes that lie within the grid.
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

/// Whether the corners (bit x + 2 y + 4 z) in `set` hang together along the cube's edges.
bool connected(unsigned set) {
  if (set == 0) return true;
  unsigned reached = set & (0u - set);
  for (unsigned before = 0; reached != before;) {
    before = reached;
    reached |= ((reached & 0x55u) << 1) | ((reached & 0xaau) >> 1) | ((reached & 0x33u) << 2) |
               ((reached & 0xccu) >> 2) | ((reached & 0x0fu) << 4) | ((reached & 0xf0u) >> 4);
    reached &= set;
  }
  return reached == set;
}

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
  std::vector<std::uint32_t> piece(voxels.count(), kNone);
  std::vector<std::size_t> sizes, waiting;
  for (std::size_t i = 0; i < voxels.count(); ++i) {
    if (!voxels.solid[i] || piece[i] != kNone) continue;
    const auto mine = static_cast<std::uint32_t>(sizes.size());
    sizes.push_back(0);
    piece[i] = mine;
    waiting.push_back(i);
    while (!waiting.empty()) {
      const std::size_t at = waiting.back();
      waiting.pop_back();
      ++sizes.back();
      for_each_neighbor(voxels.grid, at, [&](std::size_t n) {
        if (!voxels.solid[n] || piece[n] != kNone) return;
        piece[n] = mine;
        waiting.push_back(n);
      });
    }
  }
  if (sizes.empty()) return;
  const std::size_t min_size = *std::max_element(sizes.begin(), sizes.end()) / 1000 + 1;
  for (std::size_t i = 0; i < voxels.count(); ++i)
    if (voxels.solid[i] && sizes[piece[i]] < min_size) voxels.solid[i] = 0;
}

}  // namespace

std::vector<float> distances_to(const Grid& grid, const std::vector<std::uint8_t>& seed) {
  std::vector<float> squared(seed.size());
  for (std::size_t i = 0; i < seed.size(); ++i) squared[i] = seed[i] ? 0 : kInfinity;
  for (int axis = 0; axis < 3; ++axis) transform_axis(grid, axis, squared);
  for (float& d : squared) d = std::sqrt(d);
  return squared;
}

Grid grid_around(const Box& box, float cell, float radius) {
  // Points next to the border are further than the radius and a wall point's slack from the model.
  const float margin = radius + 4 * cell;
  const auto count = [&](float size) {
    return static_cast<int>(std::ceil((size + 2 * margin) / cell)) + 1;
  };
  const Vec3 size = box.size();
  return {
      box.low - Vec3{margin, margin, margin}, cell, {count(size.x), count(size.y), count(size.z)}};
}

std::vector<std::uint8_t> wall_points(const Grid& grid, const ClosestPointQuery& surface) {
  constexpr int kBlock = 8;
  std::vector<std::uint8_t> wall(points_of(grid), 0);
  const auto blocks = [](int n) { return (n + kBlock - 1) / kBlock; };
  const int bx = blocks(grid.points.x), by = blocks(grid.points.y), bz = blocks(grid.points.z);
  const float reach = 0.87f * grid.cell;
  const float block_reach = reach + 0.87f * grid.cell * kBlock;
  parallel_for(static_cast<std::int64_t>(bx) * by * bz, [&](std::int64_t b) {
    const Int3 low{static_cast<int>(b % bx) * kBlock, static_cast<int>(b / bx % by) * kBlock,
                   static_cast<int>(b / bx / by) * kBlock};
    const Vec3 middle =
        grid_point(grid, {low.x + kBlock / 2, low.y + kBlock / 2, low.z + kBlock / 2});
    if (surface.closest(middle, block_reach).triangle == ClosestPoint::kNoTriangle) return;
    for (int z = low.z; z < std::min(low.z + kBlock, grid.points.z); ++z)
      for (int y = low.y; y < std::min(low.y + kBlock, grid.points.y); ++y)
        for (int x = low.x; x < std::min(low.x + kBlock, grid.points.x); ++x) {
          const ClosestPoint found = surface.closest(grid_point(grid, {x, y, z}), reach);
          if (found.triangle == ClosestPoint::kNoTriangle) continue;
          wall[static_cast<std::size_t>(x) +
               static_cast<std::size_t>(grid.points.x) *
                   (static_cast<std::size_t>(y) +
                    static_cast<std::size_t>(grid.points.y) * static_cast<std::size_t>(z))] = 1;
        }
  });
  return wall;
}

Voxels unreachable(const Grid& grid, const std::vector<float>& from_wall, float radius) {
  Voxels voxels{grid, {}, {}};
  const float cells = radius / grid.cell;
  std::vector<std::uint8_t> reached(from_wall.size(), 0);
  // The border is free (grid_around), so its first point reaches all of it.
  std::vector<std::size_t> waiting{0};
  reached[0] = 1;
  while (!waiting.empty()) {
    const std::size_t at = waiting.back();
    waiting.pop_back();
    for_each_neighbor(grid, at, [&](std::size_t n) {
      if (reached[n] || from_wall[n] <= cells) return;
      reached[n] = 1;
      waiting.push_back(n);
    });
  }
  voxels.level = distances_to(grid, reached);
  voxels.solid.resize(voxels.level.size());
  for (std::size_t i = 0; i < voxels.level.size(); ++i) {
    voxels.level[i] -= cells + 1;
    voxels.solid[i] = voxels.level[i] > 0 ? 1 : 0;
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
            if (connected(set) && connected(~set & 0xffu)) break;
            // The empty corner furthest in becomes solid.
            std::size_t best = 0;
            float level = -kInfinity;
            for (unsigned k = 0; k < 8; ++k) {
              const std::size_t corner = cells.corner(first, k);
              if (voxels.solid[corner] || !(voxels.level[corner] > level)) continue;
              level = voxels.level[corner];
              best = corner;
            }
            voxels.solid[best] = 1;
            changed = true;
          }
        }
  }
}

VoxelSurface surface_nets(const Voxels& voxels) {
  const Cells cells{voxels};
  const Int3 n = voxels.grid.points;
  VoxelSurface surface;
  std::vector<std::uint32_t> vertex(voxels.count(), kNone);
  const auto level = [&](std::size_t i) {  // of the sign that the voxel has
    return voxels.solid[i] ? std::max(voxels.level[i], 0.01f) : std::min(voxels.level[i], -0.01f);
  };
  for (int z = 0; z + 1 < n.z; ++z)
    for (int y = 0; y + 1 < n.y; ++y)
      for (int x = 0; x + 1 < n.x; ++x) {
        const std::size_t first = voxels.index(x, y, z);
        const unsigned set = cells.solid_corners(first);
        if (set == 0 || set == 0xff) continue;
        // The mean of where the cell's edges are crossed.
        Vec3 sum;
        float count = 0;
        for (unsigned a = 0; a < 8; ++a)
          for (const unsigned step : {1u, 2u, 4u}) {
            const unsigned b = a | step;
            if (b == a || (set >> a & 1) == (set >> b & 1)) continue;
            const float la = level(cells.corner(first, a)), lb = level(cells.corner(first, b));
            const float t = la / (la - lb);
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
  const std::array<std::size_t, 3> stride{1, cells.nx, cells.nx * cells.ny};
  for (int z = 1; z + 1 < n.z; ++z)
    for (int y = 1; y + 1 < n.y; ++y)
      for (int x = 1; x + 1 < n.x; ++x) {
        const std::size_t i = voxels.index(x, y, z);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (voxels.solid[i] == voxels.solid[i + stride[axis]]) continue;
          const std::size_t u = stride[(axis + 1) % 3], v = stride[(axis + 2) % 3];
          // Counter-clockwise around the axis.
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
