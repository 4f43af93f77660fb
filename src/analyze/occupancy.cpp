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

constexpr int kScanlinesPerCell = 2;  ///< along x and along y each

/// Transforms the vertices to scanline space: scanline i lies at coordinate i along x and y, and z
/// is in cells.
std::vector<Vec3d> to_scanline_space(const Mesh& mesh, const Vec3d& origin, double cell) {
  // The offsets keep scanlines away from round coordinates, which are frequent in meshes: a
  // scanline through an edge would be counted twice.
  constexpr double kOffsetX = 1.234567e-5, kOffsetY = 3.952867e-5;
  std::vector<Vec3d> points(mesh.positions.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3d p = (Vec3d(mesh.positions[v]) - origin) * (1 / cell);
    points[v] = {p.x * kScanlinesPerCell - 0.5 + kOffsetX, p.y * kScanlinesPerCell - 0.5 + kOffsetY,
                 p.z};
  }
  return points;
}

/// The integers from `first` to `last`; none if `last` is smaller.
struct Range {
  int first = 0, last = -1;
};
/// Returns the scanlines between the smallest and the largest coordinate, within [0, count).
Range lines_between(double a, double b, double c, int count) {
  const double low = std::ceil(std::min({a, b, c})), high = std::floor(std::max({a, b, c}));
  return {static_cast<int>(std::max(low, 0.0)),
          static_cast<int>(std::min(high, static_cast<double>(count - 1)))};
}

/// The scanlines through one layer of cells perpendicular to x, with the crossings of triangles.
class Layer {
 public:
  Layer(Int3 cells, int x)
      : cells_(cells),
        x_(x),
        line_size_(static_cast<std::size_t>(cells.z) + 1),
        change_(
            static_cast<std::size_t>(kScanlinesPerCell * kScanlinesPerCell * cells.y) * line_size_,
            0.0f) {}

  /// Adds the crossings of the scanlines with a triangle in scanline space.
  void add_triangle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double twice_area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    constexpr double kMinProjectedArea = 1e-12;  // triangles with less are parallel to z
    if (!(std::abs(twice_area) > kMinProjectedArea)) return;
    const Range x_range = lines_between(a.x, b.x, c.x, kScanlinesPerCell * cells_.x);
    const Range y_range = lines_between(a.y, b.y, c.y, kScanlinesPerCell * cells_.y);
    for (int x = std::max(x_range.first, kScanlinesPerCell * x_);
         x <= std::min(x_range.last, kScanlinesPerCell * (x_ + 1) - 1); ++x)
      for (int y = y_range.first; y <= y_range.last; ++y) {
        const double wa = ((b.x - x) * (c.y - y) - (b.y - y) * (c.x - x)) / twice_area;
        const double wb = ((c.x - x) * (a.y - y) - (c.y - y) * (a.x - x)) / twice_area;
        const double wc = 1 - wa - wb;
        if (!(wa >= 0 && wb >= 0 && wc >= 0)) continue;
        // The triangle is an entry if its normal points to -z, else an exit.
        add_crossing(x - kScanlinesPerCell * x_, y, wa * a.z + wb * b.z + wc * c.z,
                     twice_area < 0 ? 1.0f : -1.0f);
      }
  }

  /// Writes the fractions inside the layer's cells: cells.y rows of cells.z values.
  void write_fractions(float* to) const {
    const auto count = static_cast<std::size_t>(cells_.z);
    for (int y = 0; y < cells_.y; ++y, to += count) {
      std::fill(to, to + count, 0.0f);
      float closed_lines = 0;
      for (int k = 0; k < kScanlinesPerCell * kScanlinesPerCell; ++k) {
        const float* change =
            line(k / kScanlinesPerCell, kScanlinesPerCell * y + k % kScanlinesPerCell);
        float inside = 0;
        for (std::size_t z = 0; z <= count; ++z) inside += change[z];
        constexpr float kMaxImbalance = 0.01f;  // entries minus exits; rounding leaves less
        if (std::abs(inside) >= kMaxImbalance) continue;
        ++closed_lines;
        inside = 0;
        for (std::size_t z = 0; z < count; ++z) {
          inside += change[z];
          to[z] += std::clamp(inside, 0.0f, 1.0f);
        }
      }
      // Make the sum the mean over the scanlines that cross no hole.
      if (closed_lines > 1)
        for (std::size_t z = 0; z < count; ++z) to[z] /= closed_lines;
    }
  }

 private:
  std::size_t line_start(int x, int y) const {
    return static_cast<std::size_t>(x * kScanlinesPerCell * cells_.y + y) * line_size_;
  }
  const float* line(int x, int y) const { return change_.data() + line_start(x, y); }
  /// Distributes a crossing at `z` over its cell and the next one, so that prefix sums give the
  /// fraction inside.
  void add_crossing(int x, int y, double z, float sign) {
    z = std::clamp(z, 0.0, cells_.z - 1e-3);  // the last crossing lies in the last cell
    const auto cell = static_cast<std::size_t>(z);
    const float fraction = static_cast<float>(z - static_cast<double>(cell));
    float* change = change_.data() + line_start(x, y) + cell;
    change[0] += sign * (1 - fraction);
    change[1] += sign * fraction;
  }

  Int3 cells_;
  int x_ = 0;
  std::size_t line_size_ = 0;  ///< values per scanline in `change_`
  std::vector<float> change_;  ///< change of the fraction inside, from cell to cell
};

/// Returns the weights of the offsets -n to n, where n is the cutoff in cells. They sum to 1.
std::vector<float> gaussian_weights(double sigma, double cutoff) {
  const int n = static_cast<int>(cutoff * sigma + 0.5);
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

/// Adds `weight` times `from` to `to`, element by element.
void add_scaled(float* to, const float* from, float weight, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] += weight * from[i];
}

/// Convolves along one axis. Rows along z are contiguous, so that each row is one vector operation.
void convolve(const CellValues& from, CellValues& to, int axis, const std::vector<float>& weights) {
  const int radius = static_cast<int>(weights.size() / 2);
  const int nx = from.cells.x, ny = from.cells.y, nz = from.cells.z;
  const auto row = static_cast<std::size_t>(nz);
  parallel_for(
      static_cast<std::int64_t>(nx) * ny,
      [&](std::int64_t column) {
        const int x = static_cast<int>(column / ny), y = static_cast<int>(column % ny);
        float* out = to.values.data() + to.index(x, y, 0);
        std::fill(out, out + row, 0.0f);
        for (int k = -radius; k <= radius; ++k) {
          const float weight = weights[static_cast<std::size_t>(k + radius)];
          if (axis == 2) {
            // out[z] += weight * in[z + k] for each z whose z + k is a cell of the row
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
      /*grain=*/16);
}

}  // namespace

CellValues compute_occupancy(const Mesh& mesh, double cell, double margin) {
  CellValues result;
  result.cell = cell;
  const Box box = bounding_box(mesh.positions);
  if (box.empty()) return result;
  // Make the grid.
  const Vec3d origin = Vec3d(box.low) - Vec3d(margin, margin, margin);
  const Vec3d size = Vec3d(box.high) - Vec3d(box.low) + Vec3d(margin, margin, margin) * 2;
  result.cells = {static_cast<int>(std::ceil(size.x / cell)),
                  static_cast<int>(std::ceil(size.y / cell)),
                  static_cast<int>(std::ceil(size.z / cell))};
  const int layers = result.cells.x;
  const std::vector<Vec3d> points = to_scanline_space(mesh, origin, cell);
  const auto find_layers = [&](const Triangle& t) {
    const Range lines = lines_between(points[t.v[0]].x, points[t.v[1]].x, points[t.v[2]].x,
                                      kScanlinesPerCell * layers);
    return lines.first > lines.last
               ? Range{}
               : Range{lines.first / kScanlinesPerCell, lines.last / kScanlinesPerCell};
  };
  // Sort the triangles into the layers that they cross. The layers are then independent.
  std::vector<std::vector<std::uint32_t>> layer_triangles(static_cast<std::size_t>(layers));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Range range = find_layers(mesh.triangles[t]);
    for (int x = range.first; x <= range.last; ++x)
      layer_triangles[static_cast<std::size_t>(x)].push_back(static_cast<std::uint32_t>(t));
  }
  result.values.resize(result.index(layers, 0, 0));
  parallel_for(layers, [&](std::int64_t x) {
    Layer layer(result.cells, static_cast<int>(x));
    for (const std::uint32_t t : layer_triangles[static_cast<std::size_t>(x)]) {
      const auto& corner = mesh.triangles[t].v;
      layer.add_triangle(points[corner[0]], points[corner[1]], points[corner[2]]);
    }
    layer.write_fractions(result.values.data() + result.index(static_cast<int>(x), 0, 0));
  });
  return result;
}

double sum_values(const CellValues& values) {
  double sum = 0;
  for (const float v : values.values) sum += static_cast<double>(v);
  return sum;
}

CellValues smooth(const CellValues& values, double sigma, double cutoff) {
  const std::vector<float> weights = gaussian_weights(sigma, cutoff);
  CellValues result = values, temporary = values;
  convolve(values, result, 0, weights);
  convolve(result, temporary, 1, weights);
  convolve(temporary, result, 2, weights);
  return result;
}

float find_level_of_volume(const CellValues& values, double count) {
  std::vector<float> positive;
  std::copy_if(values.values.begin(), values.values.end(), std::back_inserter(positive),
               [](float v) { return v > 0; });
  const auto n = static_cast<std::size_t>(std::max(1.0, std::nearbyint(count)));
  if (n >= positive.size()) return 0;
  const auto nth = positive.begin() + static_cast<std::ptrdiff_t>(n);
  std::nth_element(positive.begin(), nth, positive.end(), std::greater<>());
  return *nth;
}

IsoSurface extract_iso_surface(const CellValues& values, float level) {
  // In the engine's grid x runs fastest, in CellValues z does. So x and z are swapped here, and the
  // orientation of the triangles with them.
  auto field = std::make_shared<DistanceGrid>();
  field->grid = {
      /*origin=*/{0, 0, 0}, /*cell=*/1, {values.cells.z, values.cells.y, values.cells.x}};
  field->values.reserve(values.values.size());
  for (const float v : values.values) field->values.push_back(v - level);
  set_lipschitz(*field);
  ExtractSettings settings;
  settings.refine_steps = 0;  // values are linear along an edge
  Mesh mesh;
  const EngineStatus status = make_cpu_engine()->extract(field, field->grid, settings, mesh);
  if (status.code == EngineCode::kOutOfMemory) throw std::bad_alloc();
  PM_CHECK(status.code == EngineCode::kOk);
  IsoSurface surface;
  surface.positions = std::move(mesh.positions);
  for (Vec3& p : surface.positions) {
    std::swap(p.x, p.z);
    // A vertex is never at an end of its edge, so only its coordinate along the edge has a
    // fraction.
    const Int3 cell = {static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)};
    surface.vertex_cell.push_back(cell);
    surface.vertex_axis.push_back(p.x > static_cast<float>(cell.x)   ? std::uint8_t{0}
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
