// The surface between two objects as a level set: both objects' signed distances, pulled back by
// smooth maps and mixed (docs/method.md, Surface between; Cohen-Or, Solomovici and Levin 1998).
//
// A point x corresponds to X_A(x) on the source and to X_B(x) on the target. The field at x is
//   (1 - b) S(D_A(X_A)) + b S(D_B(X_B)) - c w,  b = t^2 (3 - 2 t).
// D_A and D_B are the distances, t is the progress at x, c the level and w its weight at x. S(d)
// has the sign of d and the magnitude s (sqrt(1 + 2 |d| / s) - 1). X_A, X_B and t are values of one
// regression over the moving balls (regression.h). If an object is a shell, w is a value of this
// regression, too; otherwise w is computed at the nodes of the regression's lattice from the
// thinness of both objects (WeighLevel). The surface is where the field is 0.
//
// Objects may have smoothed distances, too. Then most of the source's detail fades out before the
// target's detail fades in, because otherwise each would show as relief on the other object (Hughes
// 1992).
#pragma once

#include <cstdint>

#include "distance_field.h"
#include "field.h"
#include "host_device.h"
#include "regression.h"
#include "tree.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// The field as the kernels read it. It has the functions that level_set.h requires.
struct MorphField {
  static constexpr bool kHasHalves = true;
  SmoothMap map;            ///< map 0: X_A and the progress t; map 1: X_B and the weight w
  DistanceField object[2];  ///< the source and the target
  float scale[2] = {1, 1};  ///< scene units per unit of each object's distances
  float level = 0;          ///< c
  float inv_range = 0;      ///< 1 / s; 0: S(d) = d

  /// Returns S(d) as 2 d / (1 + sqrt(1 + 2 |d| / s)). Thin parts have small distances, so an
  /// uncompressed mix would hide them until the other object has almost vanished. S is odd, so that
  /// inside and outside are treated alike.
  template <class V>
  PM_HD V compress(V distance) const {
    return distance / fma(inv_slope(distance), broadcast<V>(0.5f), broadcast<V>(0.5f));
  }
  /// Returns 1 / S'(d) = sqrt(1 + 2 |d| / s).
  template <class V>
  PM_HD V inv_slope(V distance) const {
    return sqrt(fma(max(distance, -distance), broadcast<V>(2.0f * inv_range), broadcast<V>(1.0f)));
  }

  template <class V>
  PM_HD V value(const Points<V>& p) const {
    V map_values[kRegressionValues];
    map.spline(p, map_values);
    return value(p, map_values);
  }

  /// Returns the field at p, given the spline's eight values m there: m[0] to m[2] and m[4] to m[6]
  /// lead from the affine images of p to X_A and X_B; m[3] is t, and m[7] is w.
  template <class V>
  PM_HD V value(const Points<V>& p, const V (&m)[kRegressionValues]) const {
    return mix(object_value(0, p, m, m[3]), object_value(1, p, m + 4, m[3]), m[3], m[7]);
  }

  /// Returns S(D(X)) of an object (0 or 1) at p, given the four spline values of its map and t.
  template <class V>
  PM_HD V object_value(int o, const Points<V>& p, const V* m, V t) const {
    const V distance = object[o].value(map.apply(o, p, Points<V>{m[0], m[1], m[2]}),
                                       object[o].detail_share(own_progress(o, t)));
    return compress(scale[o] * distance);
  }
  /// Mixes the values of both objects where the progress is t and the level's weight is w.
  template <class V>
  PM_HD V mix(V a, V b, V t, V w) const {
    return fma(broadcast<V>(-level), w, fma(smoothstep(t), b - a, a));
  }
  /// Returns the progress as an object counts it: 0 at the object's own end of the morph.
  template <class V>
  PM_HD static V own_progress(int o, V t) {
    return o == 0 ? t : 1.0f - t;
  }

#if defined(PM_PACKS)
  /// Prefetches the distances that value() reads at the points of the brick from `first` on.
  void prefetch(const Grid& grid, Int3 first) const {
    const Points<Pack> corners = brick_corners(grid, first);
    Pack m[kRegressionValues];
    map.spline(corners, m);
    for (int o = 0; o < 2; ++o) {
      const Pack detail = object[o].detail_share(own_progress(o, m[3]));
      object[o].prefetch(map.apply(o, corners, Points<Pack>{m[4 * o], m[4 * o + 1], m[4 * o + 2]}),
                         !object[o].smooth || Lanes<Pack>::bits(detail > 0.0f) != 0,
                         object[o].smooth && Lanes<Pack>::bits(detail < 1.0f) != 0);
    }
  }

  /// The field at points of a box (level_set.h), which share sums of the spline's nodes.
  struct PackBox {
    using Scratch = PackBrickSpline::Scratch;
    const MorphField& field;
    BoxPoints points;
    PackBrickSpline spline;
    PackBox(Scratch& scratch, const MorphField& of_field, const BoxPoints& box)
        : field(of_field), points(box), spline(scratch, field.map, box.axes) {}
    void add_lines(std::uint64_t lines) {
      if (spline.has_lines()) spline.add_lines(lines);
    }
    /// Computes the map's values m at the points, and returns their positions.
    template <class V>
    Points<V> map_values(const std::uint32_t* at, V (&m)[kRegressionValues]) const {
      const Points<V> p = points.at<V>(at);
      if (spline.has_lines()) {
        spline.values(at, m);
      } else {
        field.map.spline(p, m);
      }
      return p;
    }
    template <class V>
    V value(const std::uint32_t* at) const {
      V m[kRegressionValues];
      const Points<V> p = map_values(at, m);
      return field.value(p, m);
    }
  };
#endif

  using BrickScratch = TeamBrickSpline::Scratch;
  /// Evaluates value() at the points of a brick.
  template <class V>
  struct BrickValues {
    const MorphField& field;
    Grid grid;
    Int3 first;
    TeamBrickSpline spline;
    template <class Team>
    PM_HD BrickValues(const Team& team, BrickScratch& scratch, const MorphField& of_field,
                      const Grid& of_grid, Int3 first_point)
        : field(of_field),
          grid(of_grid),
          first(first_point),
          spline(team, scratch, field.map, grid, first) {}
    PM_HD V operator()(int item) const {
      const Points<V> p = brick_points<V>(grid, first, item);
      if (!spline.has_lines()) return field.value(p);
      V map_values[kRegressionValues];
      spline.values(item, map_values);
      return field.value(p, map_values);
    }
  };

  /// Contribution of an object (0 or 1) to the gradient at a point.
  template <class V>
  struct ObjectSlope {
    V value;          ///< S(D)
    V by_progress;    ///< derivative of S(D) by t, because the share of detail depends on t, too
    Points<V> slope;  ///< derivatives of S(D) along the axes at a constant t
  };
  /// `m`: the four spline values of the object's map at p; `slopes`: their derivatives by axis.
  template <class V, class Slopes>
  PM_HD ObjectSlope<V> object_slope(int o, const Points<V>& p, const V* m, const Slopes& slopes,
                                    V t) const {
    const DistanceField& distances = object[o];
    const V progress = own_progress(o, t);
    const auto at = distances.slope(map.apply(o, p, Points<V>{m[0], m[1], m[2]}),
                                    distances.detail_share(progress));
    const V distance = scale[o] * at.value, weight = scale[o] / inv_slope(distance);
    const V share_slope = distances.detail_share_slope(progress);
    const auto along = [&](int axis) {
      const auto row_derivative = [&](int i) {
        const Vec3 row = map.affine[o].rows[i];
        return slopes[axis][i] + (axis == 0 ? row.x : axis == 1 ? row.y : row.z);
      };
      // The chain rule: the distance's gradient times the map's derivative along the axis.
      return weight * fma(at.gradient.x, row_derivative(0),
                          fma(at.gradient.y, row_derivative(1), at.gradient.z * row_derivative(2)));
    };
    return {compress(distance),
            weight * at.detail_derivative * (o == 0 ? share_slope : -share_slope),
            {along(0), along(1), along(2)}};
  }
  /// Mixes the slopes of both objects to minus the gradient. `t_slope` and `w_slope`: derivatives
  /// of the progress t and of the level's weight along the axes.
  template <class V>
  PM_HD Points<V> mix_slopes(const ObjectSlope<V>& a, const ObjectSlope<V>& b, V t,
                             const Points<V>& t_slope, const Points<V>& w_slope) const {
    const V weight_b = smoothstep(t);  // b of the formula above
    const V df_dt = fma(smoothstep_slope(t), b.value - a.value,
                        fma(weight_b, b.by_progress - a.by_progress, a.by_progress));
    const auto negated = [&](V slope_a, V slope_b, V slope_t, V slope_w) {
      return fma(broadcast<V>(level), slope_w,
                 -fma(weight_b, slope_b - slope_a, fma(df_dt, slope_t, slope_a)));
    };
    return {negated(a.slope.x, b.slope.x, t_slope.x, w_slope.x),
            negated(a.slope.y, b.slope.y, t_slope.y, w_slope.y),
            negated(a.slope.z, b.slope.z, t_slope.z, w_slope.z)};
  }

  /// Returns minus the gradient, which points outward at the surface.
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    V m[kRegressionValues], slopes[3][kRegressionValues];
    map.spline(p, m, slopes);
    const V target_slopes[3][3] = {{slopes[0][4], slopes[0][5], slopes[0][6]},
                                   {slopes[1][4], slopes[1][5], slopes[1][6]},
                                   {slopes[2][4], slopes[2][5], slopes[2][6]}};
    return mix_slopes(
        object_slope(0, p, m, slopes, m[3]), object_slope(1, p, m + 4, target_slopes, m[3]), m[3],
        {slopes[0][3], slopes[1][3], slopes[2][3]}, {slopes[0][7], slopes[1][7], slopes[2][7]});
  }

  /// The least and the greatest distance of an object at its point x while t is in a range, in the
  /// object's units.
  template <class V>
  PM_HD DistanceField::Range<V> object_range(int o, const Points<V>& x, V min_t, V max_t) const {
    const V min_progress = own_progress(o, o == 0 ? min_t : max_t),
            max_progress = own_progress(o, o == 0 ? max_t : min_t);
    return object[o].value_range(x, object[o].detail_share(max_progress),
                                 object[o].detail_share(min_progress));
  }
  /// Returns S of an object's distance, which may be `change` longer.
  template <class V>
  PM_HD V object_bound(int o, V distance, float change) const {
    return compress(scale[o] * distance + change);
  }

  /// The field as two neighbouring threads of a GPU evaluate it together: each reads the map and
  /// the distances of one object, and gets the other's part from its neighbour. Such a thread needs
  /// half as many registers, and waits for half as many loads. All threads of a warp must call the
  /// functions together.
  struct Half;
  PM_HD Half half(int o) const;
};

struct MorphField::Half {
  static constexpr bool kHasHalves = false;
  const MorphField& field;
  int own;  ///< this thread's object

  /// Returns the neighbour's value of `a`.
  PM_HD static float swap(float a) {
#if defined(__CUDA_ARCH__)
    return __shfl_xor_sync(0xffffffffu, a, 1);
#else
    return a;
#endif
  }
  /// Returns the value of the thread with the source or, of the other one, with the target.
  PM_HD float of_source(float a, float neighbours) const { return own == 0 ? a : neighbours; }
  PM_HD float of_target(float a, float neighbours) const { return own == 0 ? neighbours : a; }

  PM_HD float value(const Points<float>& p) const {
    float m[4];
    field.map.spline(p, own, m);
    const float fourth = swap(m[3]), t = of_source(m[3], fourth), w = of_target(m[3], fourth);
    const float own_value = field.object_value(own, p, m, t), other_value = swap(own_value);
    return field.mix(of_source(own_value, other_value), of_target(own_value, other_value), t, w);
  }

  PM_HD Points<float> negated_gradient(const Points<float>& p) const {
    float m[4], slopes[3][4];
    field.map.spline(p, own, m, slopes);
    const float t = of_source(m[3], swap(m[3]));
    const ObjectSlope<float> own_slope = field.object_slope(own, p, m, slopes, t);
    const Points<float> fourth = {slopes[0][3], slopes[1][3], slopes[2][3]};
    const ObjectSlope<float> other_slope = {swap(own_slope.value), swap(own_slope.by_progress),
                                            swap(own_slope.slope)};
    const Points<float> other_fourth = swap(fourth);
    return own == 0 ? field.mix_slopes(own_slope, other_slope, t, fourth, other_fourth)
                    : field.mix_slopes(other_slope, own_slope, t, other_fourth, fourth);
  }
  PM_HD static Points<float> swap(const Points<float>& a) {
    return {swap(a.x), swap(a.y), swap(a.z)};
  }
};
PM_HD inline MorphField::Half MorphField::half(int o) const { return {*this, o}; }

/// Bounds of a MorphField (level_set.h). They follow from the distances, the progress and the
/// weight in the middle of a box, and from how far each of these can change within the box.
struct MorphBounds {
  static constexpr bool kHasHalves = true;
  /// Lengths of the largest strain around a box: how fast the maps, t and w can change in it.
  struct Local {
    float maps, progress, weight;
  };
  MorphField field;
  View<const Strain> strain;  ///< per node: the largest strain in a window (MaximizeStrain)
  /// Norm of an affine map (affine_norm()) times its object's scale, the larger one of both maps.
  float affine_norm = 1;
  float lipschitz = 0;  ///< the largest Lipschitz constant of all distances
  float rounding = 0;   ///< distance_rounding() of the surface's grid, scene units

  /// Returns the lengths of the largest strain of the nodes that contribute to the maps in a box.
  template <class Team>
  PM_HD Local local(const Team&, const NodeBox& box) const {
    return lengths(largest_strain(box, /*begin=*/0, /*step=*/1));
  }
  /// Returns the largest strain of these nodes or, with a step of 2, of every other layer of
  /// windows from layer `begin` on.
  PM_HD Strain largest_strain(const NodeBox& box, int begin, int step) const {
    const Grid& lattice = field.map.lattice;
    const float origin[3] = {lattice.origin.x, lattice.origin.y, lattice.origin.z};
    const float low[3] = {box.low.x, box.low.y, box.low.z};
    const float high[3] = {box.high.x, box.high.y, box.high.z};
    const int points[3] = {lattice.points.x, lattice.points.y, lattice.points.z};
    int first[3], last_window[3], windows[3];
    for (int axis = 0; axis < 3; ++axis) {
      const SplineAxis low_end(low[axis], origin[axis], field.map.inv_spacing, points[axis]);
      const SplineAxis high_end(high[axis], origin[axis], field.map.inv_spacing, points[axis]);
      // Three nodes contribute at each end of the box. One more is taken on each side, because
      // rounding may assign a point to the next node. These are at least four nodes, as many as a
      // window has.
      first[axis] = low_end.first > 0 ? low_end.first - 1 : 0;
      const int end = high_end.first + 4 < points[axis] ? high_end.first + 4 : points[axis];
      last_window[axis] = end - kStrainWindow;
      windows[axis] = (last_window[axis] - first[axis] + kStrainWindow - 1) / kStrainWindow + 1;
    }
    // Returns the first node of a window along an axis; the last one ends where the nodes end.
    const auto window = [&](int axis, int k) {
      const int at = first[axis] + kStrainWindow * k;
      return at < last_window[axis] ? at : last_window[axis];
    };
    Strain largest;
    for (int z = begin; z < windows[2]; z += step) {
      for (int y = 0; y < windows[1]; ++y) {
        const Strain* row =
            &strain[points[0] *
                    (window(1, y) + static_cast<std::int64_t>(points[1]) * window(2, z))];
        for (int x = 0; x < windows[0]; ++x) largest = max_strain(largest, row[window(0, x)]);
      }
    }
    return largest;
  }
  PM_HD static Strain max_strain(const Strain& a, const Strain& b) {
    return {max(a.maps, b.maps), {max(a.fourth[0], b.fourth[0]), max(a.fourth[1], b.fourth[1])}};
  }
  PM_HD static Local lengths(const Strain& s) {
    const auto norm = [](Vec3 v) { return sqrt(dot(v, v)); };
    return {norm(s.maps), norm(s.fourth[0]), norm(s.fourth[1])};
  }

  template <class V>
  PM_HD std::uint32_t crossing_boxes(const Points<V>& middle, Vec3 half, const Local& strain_length,
                                     bool has_rim) const {
    V m[kRegressionValues];
    field.map.spline(middle, m);
    const Sides can_be = sides(middle, m, half, strain_length);
    return has_rim ? can_be.inside : can_be.inside & can_be.outside;
  }
  /// Returns the sides on which boxes can have points, given the map's values in their middles:
  /// bounds the field from above and from below. It grows with both distances and is linear in b,
  /// so that the ends of their ranges suffice. The factor 1.001 and the term 1e-5 allow for
  /// rounding, the latter in t and w.
  template <class V>
  PM_HD Sides sides(const Points<V>& middle, const V (&m)[kRegressionValues], Vec3 half,
                    const Local& strain_length) const {
    const Ranges<V> ranges(*this, half, strain_length, m[3], m[7]);
    const auto range_at = [&](int o) {
      const V* values = m + 4 * o;
      return field.object_range(
          o, field.map.apply(o, middle, Points<V>{values[0], values[1], values[2]}),
          ranges.min_progress, ranges.max_progress);
    };
    const auto range_a = range_at(0), range_b = range_at(1);
    const V high = ranges.high(field.object_bound(0, range_a.high, ranges.max_change),
                               field.object_bound(1, range_b.high, ranges.max_change)),
            low = ranges.low(field.object_bound(0, range_a.low, -ranges.max_change),
                             field.object_bound(1, range_b.low, -ranges.max_change));
    return {Lanes<V>::bits(high > 0.0f), Lanes<V>::bits(low <= 0.0f)};
  }
#if defined(PM_PACKS)
  template <class V>
  Sides sides(const MorphField::PackBox& box, const std::uint32_t* middles, Vec3 half,
              const Local& strain_length) const {
    V m[kRegressionValues];
    const Points<V> p = box.map_values(middles, m);
    return sides(p, m, half, strain_length);
  }
#endif

  /// Maximum changes of the distances, t and c w from the middle of a box, and the ends of the
  /// ranges of t and of b.
  template <class V>
  struct Ranges {
    float max_change, max_level_change;
    V min_progress, max_progress, min_blend, max_blend, level_term;

    /// `t` and `w`: progress and weight in the middle of the box.
    PM_HD Ranges(const MorphBounds& bounds, Vec3 half, const Local& strain_length, V t, V w) {
      const float level = bounds.field.level, abs_level = level < 0 ? -level : level;
      const float radius = 1.001f * sqrt(dot(half, half));
      max_change =
          radius * bounds.lipschitz * (bounds.affine_norm + strain_length.maps) + bounds.rounding;
      const float max_progress_change = radius * strain_length.progress + 1e-5f;
      max_level_change = abs_level * (radius * strain_length.weight + 1e-5f) + bounds.rounding;
      min_progress = t - max_progress_change, max_progress = t + max_progress_change;
      min_blend = smoothstep(min_progress), max_blend = smoothstep(max_progress);
      level_term = -level * w;
    }
    /// Bounds the field from above, given the objects' upper bounds, and from below.
    PM_HD V high(V a, V b) const {
      return max(fma(min_blend, b - a, a), fma(max_blend, b - a, a)) + level_term +
             max_level_change;
    }
    PM_HD V low(V a, V b) const {
      return min(fma(min_blend, b - a, a), fma(max_blend, b - a, a)) + level_term -
             max_level_change;
    }
  };

  /// The bounds as two neighbouring threads evaluate them together (MorphField::Half).
  struct Half;
  PM_HD Half half(int o) const;
};

struct MorphBounds::Half {
  const MorphBounds& bounds;
  MorphField::Half field;

  template <class Team>
  PM_HD Local local(const Team&, const NodeBox& box) const {
    const Strain own_strain = bounds.largest_strain(box, field.own, /*step=*/2);
    const auto swap = [](Vec3 v) {
      return Vec3{MorphField::Half::swap(v.x), MorphField::Half::swap(v.y),
                  MorphField::Half::swap(v.z)};
    };
    return lengths(max_strain(
        own_strain,
        {swap(own_strain.maps), {swap(own_strain.fourth[0]), swap(own_strain.fourth[1])}}));
  }
  PM_HD std::uint32_t crossing_boxes(const Points<float>& p, Vec3 half, const Local& strain_length,
                                     bool has_rim) const {
    const int own = field.own;
    const MorphField& morph = bounds.field;
    float m[4];
    morph.map.spline(p, own, m);
    const float fourth = field.swap(m[3]);
    const Ranges<float> ranges(bounds, half, strain_length, field.of_source(m[3], fourth),
                               field.of_target(m[3], fourth));
    const auto range =
        morph.object_range(own, morph.map.apply(own, p, Points<float>{m[0], m[1], m[2]}),
                           ranges.min_progress, ranges.max_progress);
    const float high = morph.object_bound(own, range.high, ranges.max_change),
                other_high = field.swap(high);
    const float low = morph.object_bound(own, range.low, -ranges.max_change),
                other_low = field.swap(low);
    const bool can_be_inside =
        ranges.high(field.of_source(high, other_high), field.of_target(high, other_high)) > 0.0f;
    const bool can_be_outside =
        ranges.low(field.of_source(low, other_low), field.of_target(low, other_low)) <= 0.0f;
    return can_be_inside && (has_rim || can_be_outside) ? 1u : 0u;
  }
};
PM_HD inline MorphBounds::Half MorphBounds::half(int o) const { return {*this, field.half(o)}; }

/// Writes the level's weight w = ((1 - thinness_A) (1 - thinness_B))^2 into each node of the map.
/// Thin limbs would vanish if the level, which keeps the volume, had its full weight there. With
/// the square, w rises slowly beside a thin part, so that a limb's root and a wall's rim do not
/// vanish either. One item per node.
struct WeighLevel {
  SmoothMap map;
  DistanceField thinness[2];  ///< Regression::thinness
  View<float> nodes;          ///< the map's nodes, kRegressionValues each

  PM_HD void operator()(std::int64_t n) const {
    const Int3 points = map.lattice.points;
    const std::int64_t row = n / points.x;
    const Vec3 p =
        grid_point(map.lattice, {static_cast<int>(n % points.x), static_cast<int>(row % points.y),
                                 static_cast<int>(row / points.y)});
    float* node = nodes.data + kRegressionValues * n;
    float weight = 1;
    for (int m = 0; m < 2; ++m) {
      const float* v = node + 4 * m;
      const Points<float> at =
          map.apply(m, Points<float>{p.x, p.y, p.z}, Points<float>{v[0], v[1], v[2]});
      // Beyond its grid, a DistanceField is negative; the thinness there is 0.
      weight *= 1.0f - min(max(thinness[m].value(at), 0.0f), 1.0f);
    }
    node[kRegressionValues - 1] = weight * weight;
  }
};

/// Evaluates the map's images of points and the fourth values there. One item per point.
struct SampleMap {
  SmoothMap map;
  View<const Vec3> points;
  View<AttributeValues> out;  ///< element i * maps + m: point i under map m
  int maps = 1;

  PM_HD void operator()(std::int64_t i) const {
    if (i >= points.size) return;
    const Vec3 p = points[i];
    float value[kRegressionValues];
    map.spline(Points<float>{p.x, p.y, p.z}, value);
    for (int m = 0; m < maps; ++m) {
      const float* v = value + 4 * m;
      const Points<float> x =
          map.apply(m, Points<float>{p.x, p.y, p.z}, Points<float>{v[0], v[1], v[2]});
      out[i * maps + m] = {{x.x, x.y, x.z, v[3]}};
    }
  }
};

}  // namespace polymorph
