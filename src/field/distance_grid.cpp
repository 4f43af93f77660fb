#include "field/distance_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_set>
#include <utility>
#include <vector>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "base/result.h"
#include "mesh/mesh_check.h"
#include "mesh/normals.h"
#include "mesh/thickness.h"
#include "mesh/triangle_bvh.h"

namespace polymorph {
namespace {

constexpr int kCoarse = 4;  ///< fine cells per coarse cell, along an axis
/// Radius that thin parts are brought to, over the thinnest that shows: the filter takes the rest.
constexpr float kThickened = 1.35f;
constexpr float kExact = 2, kFar = 4;  ///< in fine cells: exact up to here, smooth from there on

/// Every fourth point of distance_grid().
Grid coarse_grid(const Box& box, float cell) {
  const Vec3 size = box.size();
  const float longest = std::max({size.x, size.y, size.z});
  const float fine = std::max(cell, longest / kMaxDistanceCells);
  const float margin = std::max(0.06f * box.diagonal(), (kFar + 2 * kCoarse) * fine);
  const auto points = [&](float extent) {
    return static_cast<int>(std::ceil((extent + 2 * margin) / (kCoarse * fine))) + 1;
  };
  Grid coarse{{}, kCoarse * fine, {points(size.x), points(size.y), points(size.z)}};
  const auto middle = [&](int along) { return 0.5f * static_cast<float>(along - 1) * coarse.cell; };
  coarse.origin = box.center() -
                  Vec3{middle(coarse.points.x), middle(coarse.points.y), middle(coarse.points.z)};
  return coarse;
}

class Builder {
 public:
  Builder(const Model& model, const InsideTest& inside, const ClosestPointQuery& closest,
          std::span<const FaceSide> sides, float cell, float thinnest)
      : model_(model), inside_(inside), closest_(closest), thinnest_(thinnest), sides_(sides) {
    coarse_ = coarse_grid(model.box(), cell);
    out_.grid = distance_grid(model.box(), cell);
    cell_ = out_.grid.cell;
  }

  DistanceGrid run() {
    row_ = fine_index(0, 1, 0), layer_ = fine_index(0, 0, 1);
    shell_ = std::all_of(sides_.begin(), sides_.end(),
                         [](FaceSide side) { return side == FaceSide::kSheet; });
    closed_ = check_mesh({model_.points, {}, model_.triangles}).closed();
    measure_coarse();
    out_.values = spline_values({coarse_, smooth_}, out_.grid);
    measure_near();
    if (thinnest_ > 0) smooth_thin_parts();
    close_border(out_);
    bound_slopes(out_);
    return std::move(out_);
  }
  SmoothDistances smooth() { return {coarse_, std::move(smooth_)}; }

 private:
  std::size_t coarse_index(int x, int y, int z) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(coarse_.points.x) *
               (static_cast<std::size_t>(y) +
                static_cast<std::size_t>(coarse_.points.y) * static_cast<std::size_t>(z));
  }

  /// Is the point inside, given a neighbour `apart` that is known? Around a point there is no face
  /// nearer than its distance, so that a neighbour within that is on the same side of a closed
  /// model.
  bool inside_beside(Vec3 p, float distance, float apart, float known_distance,
                     bool known_inside) const {
    const bool same_side = closed_ && std::max(distance, known_distance) > 1.01f * apart;
    return same_side ? known_inside : is_inside(p);
  }
  bool is_inside(Vec3 p) const { return !shell_ && inside_.inside(p); }

  /// Is the closest face hidden within the solid, so that the boundary is further off?
  bool is_hidden(Vec3 p, const ClosestPoint& closest, bool in) const {
    return in &&
           (sides_[closest.triangle] == FaceSide::kMixed ||
            sides_[closest.triangle] == FaceSide::kHidden) &&
           inside_.inside(closest.point + normalized(closest.point - p) * (0.02f * cell_));
  }

  void measure_coarse() {
    const std::size_t count = coarse_index(0, 0, coarse_.points.z);
    smooth_.resize(count);
    std::vector<std::uint8_t> hidden(count, 0);
    parallel_for(
        std::int64_t{coarse_.points.y} * coarse_.points.z,
        [&](std::int64_t line) {
          float distance = 0;
          bool in = false;
          for (int x = 0; x < coarse_.points.x; ++x) {
            const std::int64_t n = line * coarse_.points.x + x;
            const Vec3 p = grid_point(coarse_, place_of(n, coarse_.points));
            const ClosestPoint closest = closest_.closest(p);
            in = x == 0 ? is_inside(p)
                        : inside_beside(p, closest.distance, coarse_.cell, distance, in);
            distance = closest.distance;
            smooth_[static_cast<std::size_t>(n)] = in ? distance : -distance;
            hidden[static_cast<std::size_t>(n)] = is_hidden(p, closest, in);
          }
        },
        4);
    reach_around(coarse_, hidden, smooth_);
  }

  static Int3 place_of(std::int64_t n, Int3 points) {
    return {static_cast<int>(n % points.x), static_cast<int>(n / points.x % points.y),
            static_cast<int>(n / points.x / points.y)};
  }

  /// Points whose closest face is hidden have at least the distance that their neighbours leave
  /// them: raised from the outside in, until nothing changes.
  static void reach_around(const Grid& grid, const std::vector<std::uint8_t>& hidden,
                           std::vector<float>& values) {
    if (std::find(hidden.begin(), hidden.end(), 1) == hidden.end()) return;
    // The boundary's distance is 1-Lipschitz: the largest function that is, and agrees with what is
    // known, is the least over all known points of their value plus the distance from there.
    constexpr float kUnknown = 1e30f;
    for (std::size_t n = 0; n < values.size(); ++n)
      if (hidden[n]) values[n] = kUnknown;
    const Int3 size = grid.points;
    const auto sweep = [&](bool forward) {
      const std::int64_t count = std::int64_t{size.x} * size.y * size.z;
      for (std::int64_t k = 0; k < count; ++k) {
        const std::int64_t n = forward ? k : count - 1 - k;
        if (!hidden[static_cast<std::size_t>(n)]) continue;
        const Int3 at = place_of(n, size);
        float min_value = values[static_cast<std::size_t>(n)];
        for (int dz = -1; dz <= 1; ++dz)
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
              const Int3 q{at.x + dx, at.y + dy, at.z + dz};
              if (q.x < 0 || q.y < 0 || q.z < 0 || q.x >= size.x || q.y >= size.y || q.z >= size.z)
                continue;
              const std::int64_t m = q.x + static_cast<std::int64_t>(size.x) *
                                               (q.y + static_cast<std::int64_t>(size.y) * q.z);
              const float way =
                  grid.cell * std::sqrt(static_cast<float>(dx * dx + dy * dy + dz * dz));
              min_value = std::min(min_value, values[static_cast<std::size_t>(m)] + way);
            }
        values[static_cast<std::size_t>(n)] = min_value;
      }
    };
    for (int i = 0; i < 2; ++i) sweep(true), sweep(false);
    for (std::size_t n = 0; n < values.size(); ++n)
      if (values[n] >= kUnknown) values[n] = 0;
  }

  std::size_t fine_index(int x, int y, int z) const {
    const Int3 n = out_.grid.points;
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(n.x) *
               (static_cast<std::size_t>(y) +
                static_cast<std::size_t>(n.y) * static_cast<std::size_t>(z));
  }

  /// Exact distances near the surface, in blocks of kCoarse^3 points that may hold some of it.
  void measure_near() {
    const Int3 blocks{coarse_.points.x, coarse_.points.y, coarse_.points.z};
    const float reach = kFar * cell_;
    const float half = 0.5f * std::sqrt(3.0f) * (kCoarse - 1) * cell_;
    const float middle = 0.5f * (kCoarse - 1) * cell_;
    parallel_for(
        std::int64_t{blocks.x} * blocks.y * blocks.z,
        [&](std::int64_t b) {
          const Int3 block = place_of(b, blocks);
          const Int3 first{block.x * kCoarse, block.y * kCoarse, block.z * kCoarse};
          const Vec3 low = grid_point(out_.grid, first);
          const ClosestPoint near =
              closest_.closest(low + Vec3{middle, middle, middle}, reach + half);
          if (near.triangle == ClosestPoint::kNoTriangle) return;
          measure_block(first, reach);
        },
        4);
  }

  void measure_block(Int3 first, float reach) {
    const Int3 n = out_.grid.points;
    const Int3 end{std::min(first.x + kCoarse, n.x), std::min(first.y + kCoarse, n.y),
                   std::min(first.z + kCoarse, n.z)};
    float distance[kCoarse][kCoarse][kCoarse];
    bool in[kCoarse][kCoarse][kCoarse];
    for (int z = 0; z < end.z - first.z; ++z)
      for (int y = 0; y < end.y - first.y; ++y)
        for (int x = 0; x < end.x - first.x; ++x) {
          const Int3 at{first.x + x, first.y + y, first.z + z};
          const Vec3 p = grid_point(out_.grid, at);
          const ClosestPoint near = closest_.closest(p, reach);
          distance[z][y][x] = near.distance;
          const Int3 before{x > 0 ? x - 1 : x, x == 0 && y > 0 ? y - 1 : y,
                            x == 0 && y == 0 && z > 0 ? z - 1 : z};
          const bool is_first = x == 0 && y == 0 && z == 0;
          in[z][y][x] = is_first ? is_inside(p)
                                 : inside_beside(p, near.distance, cell_,
                                                 distance[before.z][before.y][before.x],
                                                 in[before.z][before.y][before.x]);
          if (near.triangle != ClosestPoint::kNoTriangle)
            set_near(out_.values[fine_index(at.x, at.y, at.z)], p, near, in[z][y][x]);
        }
  }

  void set_near(float& value, Vec3 p, const ClosestPoint& near, bool in) const {
    if (is_hidden(p, near, in)) return;
    float exact = in ? near.distance : -near.distance;
    if (!in && sides_[near.triangle] == FaceSide::kSheet)
      exact = std::max(exact, kThickened * thinnest_ - near.distance);
    const float t = std::clamp((near.distance / cell_ - kExact) / (kFar - kExact), 0.0f, 1.0f);
    const float smooth = t * t * (3 - 2 * t);
    value = exact + smooth * (value - exact);
  }

  static Vec3 position(int x, int y, int z) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }

  /// Where distances rise from both sides towards a point and are less than `radius` there, on
  /// either side of the surface: the ridge of a thin part or of a narrow gap.
  bool is_on_ridge(int x, int y, int z, float radius) const {
    // Distances rise along the ridge between two faces by the sine of half the angle between them:
    // faces at up to 97 degrees.
    constexpr float kSteepest = 0.75f;
    const std::size_t i = fine_index(x, y, z);
    const float v = std::fabs(out_.values[i]);
    if (!(v > 0) || v >= radius) return false;
    const auto slope = [&](std::size_t step) {
      return out_.values[i + step] - out_.values[i - step];
    };
    const Vec3 gradient{slope(1), slope(row_), slope(layer_)};
    return length(gradient) < 2 * cell_ * kSteepest;
  }

  /// Of each point the square of how far it is from the nearest ridge, in cells; more than the
  /// square of `cells` where that is further. One axis after the other (a distance transform), as
  /// ridges may be everywhere.
  std::vector<std::uint16_t> squares_to_ridges(float radius, int cells) const {
    constexpr std::uint16_t kNone = 0x3fff;
    PM_CHECK(2 * cells * cells < kNone);
    const Int3 n = out_.grid.points;
    std::vector<std::uint16_t> squares(out_.values.size(), kNone);
    const auto each_near = [&](int at, int points, const auto& f) {
      for (int k = std::max(at - cells, 0); k <= std::min(at + cells, points - 1); ++k)
        f(k, static_cast<std::uint16_t>((k - at) * (k - at)));
    };
    parallel_for(n.z - 2, [&](std::int64_t layer) {
      const int z = static_cast<int>(layer) + 1;
      for (int y = 1; y + 1 < n.y; ++y)
        for (int x = 1; x + 1 < n.x; ++x)
          if (is_on_ridge(x, y, z, radius))
            each_near(x, n.x, [&](int k, std::uint16_t square) {
              std::uint16_t& v = squares[fine_index(k, y, z)];
              v = std::min(v, square);
            });
    });
    // Rows of x side by side: `count` of them, `step` apart, in each of `planes`.
    const auto pass = [&](int planes, std::size_t apart, int count, std::size_t step) {
      parallel_for(planes, [&](std::int64_t plane) {
        std::uint16_t* rows = squares.data() + static_cast<std::size_t>(plane) * apart;
        std::vector<std::uint16_t> copy(row_ * static_cast<std::size_t>(count));
        for (int i = 0; i < count; ++i)
          std::copy_n(rows + static_cast<std::size_t>(i) * step, row_,
                      copy.data() + static_cast<std::size_t>(i) * row_);
        for (int i = 0; i < count; ++i) {
          std::uint16_t* to = rows + static_cast<std::size_t>(i) * step;
          each_near(i, count, [&](int k, std::uint16_t square) {
            const std::uint16_t* from = copy.data() + static_cast<std::size_t>(k) * row_;
            for (std::size_t x = 0; x < row_; ++x)
              to[x] = std::min(to[x], static_cast<std::uint16_t>(from[x] + square));
          });
        }
      });
    };
    pass(n.z, layer_, n.y, row_);
    pass(n.y, row_, n.z, layer_);
    return squares;
  }

  static std::uint64_t half_cell(Vec3 at) {
    const auto part = [](float x) { return static_cast<std::uint64_t>(2 * std::max(x, 0.0f)); };
    return part(at.x) << 40 | part(at.y) << 20 | part(at.z);
  }

  /// Middles of the walls that are thinner than a diameter of `radius` and not hidden, as positions
  /// in cells, a list per layer of points. Rays find what no point of the grid lies in.
  std::vector<std::vector<Vec3>> thin_walls(float radius) const {
    constexpr double kSpacing = 0.7;    // in cells: neighbours' balls overlap
    constexpr double kMinCosine = 0.9;  // of 26 degrees: edges that are no sharper stay sharp
    constexpr double kMaxSamples = 400'000;
    const double spacing =
        std::max(kSpacing * static_cast<double>(cell_), std::sqrt(area_of(model_) / kMaxSamples));
    const TriangleBvh bvh = build_split_bvh(model_.points, model_.triangles);
    std::vector<std::vector<Vec3>> layers(static_cast<std::size_t>(out_.grid.points.z));
    std::unordered_set<std::uint64_t>
        taken;  // half cells; thin triangles crowd around their common point
    for (const Vec3 p :
         thin_wall_middles(model_, bvh, spacing, 2 * static_cast<double>(radius), kMinCosine)) {
      const Vec3 at = (p - out_.grid.origin) / cell_;
      if (bvh.is_split && !taken.insert(half_cell(at)).second) continue;
      // A wall within a thick part is hidden: the distances there say so.
      const Int3 near{static_cast<int>(at.x + 0.5f), static_cast<int>(at.y + 0.5f),
                      static_cast<int>(at.z + 0.5f)};
      if (out_.values[fine_index(near.x, near.y, near.z)] < 2 * radius)
        layers[static_cast<std::size_t>(near.z)].push_back(at);
    }
    return layers;
  }

  /// At all points within `reach` of the middles, the largest of f(distance) and what stood there.
  template <class F>
  void raise_around(const std::vector<std::vector<Vec3>>& middles, float reach, const F& f) {
    const Int3 n = out_.grid.points;
    const int cells = static_cast<int>(std::floor(reach / cell_)) + 1;
    const auto range = [&](int at, int points) {
      return std::pair(std::max(at - cells, 0), std::min(at + cells, points - 1));
    };
    parallel_for(n.z, [&](std::int64_t layer) {
      const int z = static_cast<int>(layer);
      const auto [first_z, last_z] = range(z, n.z);
      for (int k = first_z; k <= last_z; ++k)
        for (const Vec3 at : middles[static_cast<std::size_t>(k)]) {
          const auto [first_y, last_y] = range(static_cast<int>(at.y), n.y);
          const auto [first_x, last_x] = range(static_cast<int>(at.x), n.x);
          for (int y = first_y; y <= last_y; ++y)
            for (int x = first_x; x <= last_x; ++x) {
              const float distance = cell_ * length(position(x, y, z) - at);
              if (distance > reach) continue;
              float& v = out_.values[fine_index(x, y, z)];
              v = std::max(v, f(distance));
            }
        }
    });
  }

  /// Removes what cells of the surface's size would show as fragments: near thin parts and narrow
  /// gaps the distances pass a Gaussian, after thin parts have been made as thick as what that
  /// leaves. Elsewhere edges stay as they are.
  void smooth_thin_parts() {
    const float radius = kThickened * thinnest_, sigma = 0.65f * thinnest_;
    const auto thin = thin_walls(radius);
    // Beyond the thickened part's surface twice as steep, to meet what was there.
    const auto ball = [&](float distance) {
      return distance < radius ? radius - distance : 2 * (radius - distance);
    };
    const double before = count_inside();
    raise_around(thin, 2 * radius, ball);
    // On their way such parts are thinner still, and cells would show them as rows of beads. Steep
    // to their middles they come and go at once; but not where they are much of the whole, as a
    // spider's legs are.
    constexpr double kSteepest = 3, kMuch = 0.03;
    const double grown = before > 0 ? count_inside() / before - 1 : 1;
    const double rare = std::clamp(1 - grown / kMuch, 0.0, 1.0);
    const auto steepness = static_cast<float>(1 + (kSteepest - 1) * rare);
    if (steepness > 1)
      raise_around(thin, radius, [&](float distance) { return steepness * (radius - distance); });
    const float near = 1.5f * radius, far = 2.5f * radius;
    const std::vector<std::uint16_t> squares =
        squares_to_ridges(radius, static_cast<int>(std::floor(far / cell_)) + 1);
    const auto falling = [&](float distance) {
      const float t = std::clamp((far - distance) / (far - near), 0.0f, 1.0f);
      return t * t * (3 - 2 * t);
    };
    std::vector<float> smooth = out_.values;
    low_pass(smooth, sigma / cell_);
    parallel_for(
        static_cast<std::int64_t>(squares.size()),
        [&](std::int64_t i) {
          const auto at = static_cast<std::size_t>(i);
          const float share = falling(cell_ * std::sqrt(static_cast<float>(squares[at])));
          out_.values[at] += share * (smooth[at] - out_.values[at]);
        },
        4096);
  }

  double count_inside() const {
    return static_cast<double>(
        std::count_if(out_.values.begin(), out_.values.end(), [](float v) { return v > 0; }));
  }

  /// A Gaussian along each axis in turn; sigma in cells.
  void low_pass(std::vector<float>& v, float sigma) const {
    const int reach = static_cast<int>(std::ceil(2.5f * sigma));
    std::vector<float> weights;
    float sum = 0;
    for (int i = -reach; i <= reach; ++i) {
      const double t = i / static_cast<double>(sigma);
      weights.push_back(static_cast<float>(exact::exp(-0.5 * t * t)));
      sum += weights.back();
    }
    for (float& w : weights) w /= sum;
    const Int3 n = out_.grid.points;
    // Along lines of `count` runs of `width` neighbours, `step` apart.
    const auto pass = [&](std::size_t lines, std::size_t apart, int count, std::size_t step,
                          std::size_t width) {
      parallel_for(static_cast<std::int64_t>(lines), [&](std::int64_t l) {
        float* line = v.data() + static_cast<std::size_t>(l) * apart;
        std::vector<float> copy(static_cast<std::size_t>(count) * width);
        for (int i = 0; i < count; ++i)
          std::copy_n(line + static_cast<std::size_t>(i) * step, width,
                      copy.data() + static_cast<std::size_t>(i) * width);
        for (int i = 0; i < count; ++i) {
          float* to = line + static_cast<std::size_t>(i) * step;
          std::fill_n(to, width, 0.0f);
          for (int k = -reach; k <= reach; ++k) {
            const float w = weights[static_cast<std::size_t>(k + reach)];
            const float* from =
                copy.data() + static_cast<std::size_t>(std::clamp(i + k, 0, count - 1)) * width;
            for (std::size_t x = 0; x < width; ++x) to[x] += w * from[x];
          }
        }
      });
    };
    pass(static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z), row_, n.x, 1, 1);
    pass(static_cast<std::size_t>(n.z), layer_, n.y, row_, row_);
    pass(static_cast<std::size_t>(n.y), row_, n.z, layer_, row_);
  }

  const Model& model_;
  const InsideTest& inside_;
  const ClosestPointQuery& closest_;
  float cell_ = 0, thinnest_ = 0;
  Grid coarse_;
  bool closed_ = false;
  bool shell_ = false;  ///< all faces are sheets: nothing is inside
  std::span<const FaceSide> sides_;
  std::vector<float> smooth_;  ///< at the coarse points
  DistanceGrid out_;
  std::size_t row_ = 1, layer_ = 1;  ///< steps along y and z
};

}  // namespace

Grid distance_grid(const Box& box, float cell) {
  const Grid coarse = coarse_grid(box, cell);
  const Int3 n = coarse.points;
  return {coarse.origin,
          coarse.cell / kCoarse,
          {kCoarse * (n.x - 1) + 1, kCoarse * (n.y - 1) + 1, kCoarse * (n.z - 1) + 1}};
}

std::vector<float> spline_values(const SmoothDistances& smooth, const Grid& fine) {
  const Int3 n = fine.points, nodes = smooth.grid.points;
  const auto width = static_cast<std::size_t>(n.x);
  std::vector<float> values(width * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z));
  struct Axis {
    int at[3];
    float weight[3];
  };
  const auto axis_at = [](int point, int count) {
    Axis axis;
    const float u = static_cast<float>(point) / kCoarse;
    const float middle = std::floor(u + 0.5f), f = u - middle;
    axis.weight[0] = 0.5f * (0.5f - f) * (0.5f - f);
    axis.weight[2] = 0.5f * (0.5f + f) * (0.5f + f);
    axis.weight[1] = 1 - axis.weight[0] - axis.weight[2];
    for (int i = 0; i < 3; ++i)
      axis.at[i] = std::clamp(static_cast<int>(middle) - 1 + i, 0, count - 1);
    return axis;
  };
  std::vector<Axis> along_x;
  for (int x = 0; x < n.x; ++x) along_x.push_back(axis_at(x, nodes.x));
  parallel_for(n.z, [&](std::int64_t z) {
    const Axis az = axis_at(static_cast<int>(z), nodes.z);
    std::vector<float> line(static_cast<std::size_t>(nodes.x));
    for (int y = 0; y < n.y; ++y) {
      const Axis ay = axis_at(y, nodes.y);
      std::fill(line.begin(), line.end(), 0.0f);
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j) {
          const float weight = az.weight[k] * ay.weight[j];
          const float* from =
              smooth.values.data() + line.size() * (static_cast<std::size_t>(ay.at[j]) +
                                                    static_cast<std::size_t>(nodes.y) *
                                                        static_cast<std::size_t>(az.at[k]));
          for (std::size_t x = 0; x < line.size(); ++x) line[x] += weight * from[x];
        }
      float* to =
          values.data() + width * (static_cast<std::size_t>(y) +
                                   static_cast<std::size_t>(n.y) * static_cast<std::size_t>(z));
      for (std::size_t x = 0; x < width; ++x) {
        const Axis& ax = along_x[x];
        to[x] = 0;
        for (int i = 0; i < 3; ++i)
          to[x] += ax.weight[i] * line[static_cast<std::size_t>(ax.at[i])];
      }
    }
  });
  return values;
}

void close_border(DistanceGrid& distances) {
  const Int3 n = distances.grid.points;
  std::size_t i = 0;
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x, ++i) {
        const bool border =
            x == 0 || y == 0 || z == 0 || x == n.x - 1 || y == n.y - 1 || z == n.z - 1;
        if (border) distances.values[i] = std::min(distances.values[i], -distances.grid.cell);
      }
}

void bound_slopes(DistanceGrid& distances) {
  const Int3 n = distances.grid.points;
  const auto row = static_cast<std::size_t>(n.x), layer_size = row * static_cast<std::size_t>(n.y);
  std::vector<float> of_layer(static_cast<std::size_t>(n.z - 1), 0.0f);
  parallel_for(n.z - 1, [&](std::int64_t z) {
    float largest = 0;
    for (int y = 0; y + 1 < n.y; ++y)
      for (int x = 0; x + 1 < n.x; ++x) {
        const float* low = distances.values.data() + static_cast<std::size_t>(x) +
                           static_cast<std::size_t>(y) * row +
                           static_cast<std::size_t>(z) * layer_size;
        float c[8];
        for (std::size_t i = 0; i < 8; ++i)
          c[i] = low[(i & 1) + (i >> 1 & 1) * row + (i >> 2) * layer_size];
        float square = 0;
        for (int axis = 0; axis < 3; ++axis) {
          float steepest = 0;
          for (int i = 0; i < 8; ++i)
            if (!(i >> axis & 1)) steepest = std::max(steepest, std::fabs(c[i | 1 << axis] - c[i]));
          square += steepest * steepest;
        }
        largest = std::max(largest, square);
      }
    of_layer[static_cast<std::size_t>(z)] = largest;
  });
  const float square = *std::max_element(of_layer.begin(), of_layer.end());
  distances.lipschitz = std::max(1.0f, std::sqrt(square) / distances.grid.cell);
}

DistanceGrid signed_distances(const Model& model, const InsideTest& inside,
                              const ClosestPointQuery& closest, std::span<const FaceSide> sides,
                              float cell, float thinnest, SmoothDistances* smooth) {
  PM_CHECK(cell > 0 && !model.triangles.empty() && sides.size() == model.triangles.size());
  Builder builder(model, inside, closest, sides, cell, thinnest);
  DistanceGrid distances = builder.run();
  if (smooth) *smooth = builder.smooth();
  return distances;
}

}  // namespace polymorph
