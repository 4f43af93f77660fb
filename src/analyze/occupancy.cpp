#include "analyze/occupancy.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <memory>
#include <new>
#include <utility>

#include "base/parallel.h"
#include "base/result.h"
#include "field/distance_grid.h"
#include "kernels/engine.h"
#include "kernels/linear.h"

namespace polymorph {
namespace {

constexpr int kLines = 2;  ///< a cell, along x and along y

/// The mesh in the unit of lines along x and y, where line i is at i, and of cells along z.
std::vector<Vec3d> in_lines(const Mesh& mesh, const Vec3d& origin, double cell) {
  // Off the numbers that meshes like: a line through an edge would be counted twice.
  constexpr double kOffX = 1.234567e-5, kOffY = 3.952867e-5;
  std::vector<Vec3d> points(mesh.positions.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3d p = (Vec3d(mesh.positions[v]) - origin) * (1 / cell);
    points[v] = {p.x * kLines - 0.5 + kOffX, p.y * kLines - 0.5 + kOffY, p.z};
  }
  return points;
}

struct Range {
  int first = 0, last = -1;
};
/// The whole numbers among these coordinates, within [0, count).
Range lines_between(double a, double b, double c, int count) {
  const double low = std::ceil(std::min({a, b, c})), high = std::floor(std::max({a, b, c}));
  return {static_cast<int>(std::max(low, 0.0)),
          static_cast<int>(std::min(high, static_cast<double>(count - 1)))};
}

/// What lies inside along the lines of one layer of cells across x.
class Layer {
 public:
  Layer(Int3 cells, int x)
      : cells_(cells),
        x_(x),
        line_(static_cast<std::size_t>(cells.z) + 1),
        change_(static_cast<std::size_t>(kLines * kLines * cells.y) * line_, 0.0f) {}

  void add(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double twice = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    constexpr double kUpright = 1e-12;
    if (!(std::abs(twice) > kUpright)) return;
    const Range across = lines_between(a.x, b.x, c.x, kLines * cells_.x);
    const Range along = lines_between(a.y, b.y, c.y, kLines * cells_.y);
    for (int x = std::max(across.first, kLines * x_);
         x <= std::min(across.last, kLines * (x_ + 1) - 1); ++x)
      for (int y = along.first; y <= along.last; ++y) {
        const double wa = ((b.x - x) * (c.y - y) - (b.y - y) * (c.x - x)) / twice;
        const double wb = ((c.x - x) * (a.y - y) - (c.y - y) * (a.x - x)) / twice;
        const double wc = 1 - wa - wb;
        if (!(wa >= 0 && wb >= 0 && wc >= 0)) continue;
        cross_at(x - kLines * x_, y, wa * a.z + wb * b.z + wc * c.z, twice < 0 ? 1.0f : -1.0f);
      }
  }

  /// The shares of the layer's cells, y by y.
  void write(float* to) const {
    const auto count = static_cast<std::size_t>(cells_.z);
    for (int y = 0; y < cells_.y; ++y, to += count) {
      std::fill(to, to + count, 0.0f);
      float whole = 0;
      for (int k = 0; k < kLines * kLines; ++k) {
        const float* change = line(k / kLines, kLines * y + k % kLines);
        float inside = 0;
        for (std::size_t z = 0; z <= count; ++z) inside += change[z];
        constexpr float kOpen = 0.01f;
        if (std::abs(inside) >= kOpen) continue;
        ++whole;
        inside = 0;
        for (std::size_t z = 0; z < count; ++z) {
          inside += change[z];
          to[z] += std::clamp(inside, 0.0f, 1.0f);
        }
      }
      if (whole > 1)
        for (std::size_t z = 0; z < count; ++z) to[z] /= whole;
    }
  }

 private:
  std::size_t start_of(int x, int y) const {
    return static_cast<std::size_t>(x * kLines * cells_.y + y) * line_;
  }
  const float* line(int x, int y) const { return change_.data() + start_of(x, y); }
  void cross_at(int x, int y, double z, float sign) {
    z = std::clamp(z, 0.0, cells_.z - 1e-3);
    const auto cell = static_cast<std::size_t>(z);
    const float rest = static_cast<float>(z - static_cast<double>(cell));
    float* change = change_.data() + start_of(x, y) + cell;
    change[0] += sign * (1 - rest);
    change[1] += sign * rest;
  }

  Int3 cells_;
  int x_ = 0;
  std::size_t line_ = 0;  ///< numbers per line: the change of the inside from cell to cell
  std::vector<float> change_;
};

/// Weights of -n ... n, as float, with sum 1.
std::vector<float> gaussian_weights(double sigma, double reach) {
  const int n = static_cast<int>(reach * sigma + 0.5);
  std::vector<double> weights;
  double sum = 0;
  for (int k = -n; k <= n; ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (sigma * sigma)));
    sum += weights.back();
  }
  std::vector<float> result;
  for (const double w : weights) result.push_back(static_cast<float>(w / sum));
  return result;
}

/// to[i] += weight * from[i]
void add_scaled(float* to, const float* from, float weight, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] += weight * from[i];
}

/// One pass along an axis; rows along z.
void convolve(const CellValues& from, CellValues& to, int axis, const std::vector<float>& weights) {
  const int reach = static_cast<int>(weights.size() / 2);
  const int nx = from.cells.x, ny = from.cells.y, nz = from.cells.z;
  const auto row = static_cast<std::size_t>(nz);
  parallel_for(
      static_cast<std::int64_t>(nx) * ny,
      [&](std::int64_t at) {
        const int x = static_cast<int>(at / ny), y = static_cast<int>(at % ny);
        float* out = to.values.data() + to.index(x, y, 0);
        std::fill(out, out + row, 0.0f);
        for (int k = -reach; k <= reach; ++k) {
          const float weight = weights[static_cast<std::size_t>(k + reach)];
          if (axis == 2) {
            const float* in = from.values.data() + from.index(x, y, 0);
            const int first = std::max(0, -k), last = std::min(nz, nz - k);
            if (first < last)
              add_scaled(out + first, in + first + k, weight,
                         static_cast<std::size_t>(last - first));
            continue;
          }
          const int i = (axis == 0 ? x : y) + k;
          if (i < 0 || i >= (axis == 0 ? nx : ny)) continue;
          const std::size_t in = axis == 0 ? from.index(i, y, 0) : from.index(x, i, 0);
          add_scaled(out, from.values.data() + in, weight, row);
        }
      },
      16);
}

}  // namespace

CellValues occupancy_of(const Mesh& mesh, double cell, double margin) {
  CellValues result;
  result.cell = cell;
  const Box box = box_of(mesh.positions);
  if (box.empty()) return result;
  const Vec3d origin = Vec3d(box.low) - Vec3d(margin, margin, margin);
  const Vec3d size = Vec3d(box.high) - Vec3d(box.low) + Vec3d(margin, margin, margin) * 2;
  result.cells = {static_cast<int>(std::ceil(size.x / cell)),
                  static_cast<int>(std::ceil(size.y / cell)),
                  static_cast<int>(std::ceil(size.z / cell))};
  const int layers = result.cells.x;
  const std::vector<Vec3d> points = in_lines(mesh, origin, cell);
  // The triangles of each layer, in their order.
  const auto layers_of = [&](const Triangle& t) {
    const Range lines =
        lines_between(points[t.v[0]].x, points[t.v[1]].x, points[t.v[2]].x, kLines * layers);
    return lines.first > lines.last ? Range{} : Range{lines.first / kLines, lines.last / kLines};
  };
  std::vector<std::vector<std::uint32_t>> of_layer(static_cast<std::size_t>(layers));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Range range = layers_of(mesh.triangles[t]);
    for (int x = range.first; x <= range.last; ++x)
      of_layer[static_cast<std::size_t>(x)].push_back(static_cast<std::uint32_t>(t));
  }
  result.values.resize(result.index(layers, 0, 0));
  parallel_for(layers, [&](std::int64_t x) {
    Layer layer(result.cells, static_cast<int>(x));
    for (const std::uint32_t t : of_layer[static_cast<std::size_t>(x)]) {
      const auto& corner = mesh.triangles[t].v;
      layer.add(points[corner[0]], points[corner[1]], points[corner[2]]);
    }
    layer.write(result.values.data() + result.index(static_cast<int>(x), 0, 0));
  });
  return result;
}

double sum_of(const CellValues& values) {
  double sum = 0;
  for (const float v : values.values) sum += static_cast<double>(v);
  return sum;
}

CellValues smoothed(const CellValues& values, double sigma, double reach) {
  const std::vector<float> weights = gaussian_weights(sigma, reach);
  CellValues one = values, two = values;
  convolve(values, one, 0, weights);
  convolve(one, two, 1, weights);
  convolve(two, one, 2, weights);
  return one;
}

float level_of_volume(const CellValues& values, double count) {
  std::vector<float> positive;
  std::copy_if(values.values.begin(), values.values.end(), std::back_inserter(positive),
               [](float v) { return v > 0; });
  const auto n = static_cast<std::size_t>(std::max(1.0, std::nearbyint(count)));
  if (n >= positive.size()) return 0;
  const auto nth = positive.begin() + static_cast<std::ptrdiff_t>(n);
  std::nth_element(positive.begin(), nth, positive.end(), std::greater<>());
  return *nth;
}

IsoSurface iso_surface(const CellValues& values, float level) {
  // The engine's x runs fastest, here z does: its axes are swapped, and with them the triangles'
  // orientation.
  auto heights = std::make_shared<DistanceGrid>();
  heights->grid = {{0, 0, 0}, 1, {values.cells.z, values.cells.y, values.cells.x}};
  heights->values.reserve(values.values.size());
  for (const float v : values.values) heights->values.push_back(v - level);
  bound_slopes(*heights);
  ExtractSettings settings;
  settings.refine_steps = 0;  // values are linear along an edge
  Mesh mesh;
  const EngineStatus status = make_cpu_engine()->extract(heights, heights->grid, settings, mesh);
  if (status.code == EngineCode::kOutOfMemory) throw std::bad_alloc();
  PM_CHECK(status.code == EngineCode::kOk);
  IsoSurface surface;
  surface.positions = std::move(mesh.positions);
  for (Vec3& p : surface.positions) {
    std::swap(p.x, p.z);
    // A vertex is never at an end of its edge.
    const Int3 cell = {static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)};
    surface.from.push_back(cell);
    surface.axis.push_back(p.x > static_cast<float>(cell.x)   ? std::uint8_t{0}
                           : p.y > static_cast<float>(cell.y) ? std::uint8_t{1}
                                                              : std::uint8_t{2});
  }
  surface.triangles = std::move(mesh.triangles);
  for (Triangle& t : surface.triangles) std::swap(t.v[1], t.v[2]);
  return surface;
}

std::vector<double> vertex_areas(const IsoSurface& surface) {
  std::vector<double> areas(surface.positions.size(), 0);
  for (const Triangle& t : surface.triangles) {
    const Vec3d a(surface.positions[t.v[0]]), b(surface.positions[t.v[1]]),
        c(surface.positions[t.v[2]]);
    const double third = length(cross(b - a, c - a)) / 6;
    for (const std::uint32_t v : t.v) areas[v] += third;
  }
  return areas;
}

}  // namespace polymorph
