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
  SmoothMap map;  ///< map 0: X_A and the progress t; map 1: X_B and the weight w
  DistanceField from, to;
  float from_scale = 1, to_scale = 1;  ///< scene units per unit of each object's distances
  float level = 0;                     ///< c
  float inv_range = 0;                 ///< 1 / s; 0: S(d) = d

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
    const V a = compress(from_scale * from.value(map.apply(0, p, Points<V>{m[0], m[1], m[2]}),
                                                 from.detail_share(m[3])));
    const V b = compress(to_scale * to.value(map.apply(1, p, Points<V>{m[4], m[5], m[6]}),
                                             to.detail_share(1.0f - m[3])));
    return fma(broadcast<V>(-level), m[7], fma(smoothstep(m[3]), b - a, a));
  }

#if defined(PM_PACKS)
  /// Prefetches the distances that value() reads at the points of the brick from `first` on.
  void prefetch(const Grid& grid, Int3 first) const {
    Pack map_values[kRegressionValues];
    Points<Pack> on_source, on_target;
    pull_back(brick_corners(grid, first), map_values, on_source, on_target);
    const auto prefetch_object = [](const DistanceField& object, const Points<Pack>& corners,
                                    Pack detail) {
      object.prefetch(corners, !object.smooth || Lanes<Pack>::bits(detail > 0.0f) != 0,
                      object.smooth && Lanes<Pack>::bits(detail < 1.0f) != 0);
    };
    prefetch_object(from, on_source, from.detail_share(map_values[3]));
    prefetch_object(to, on_target, to.detail_share(1.0f - map_values[3]));
  }
#endif

  using BrickScratch = TeamBrickSpline::Scratch;
  /// Evaluates value() at the points of a brick, a pack at a time.
  template <class V>
  struct BrickValues {
    const MorphField& field;
    Grid grid;
    Int3 first;
    BrickSpline<V> spline;
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

  /// Computes the map's values m at p, and the corresponding points a on the source and b on the
  /// target.
  template <class V>
  PM_HD void pull_back(const Points<V>& p, V (&m)[kRegressionValues], Points<V>& a,
                       Points<V>& b) const {
    map.spline(p, m);
    a = map.apply(0, p, Points<V>{m[0], m[1], m[2]});
    b = map.apply(1, p, Points<V>{m[4], m[5], m[6]});
  }

  /// Returns minus the gradient, which points outward at the surface.
  template <class V>
  PM_HD Points<V> negated_gradient(const Points<V>& p) const {
    V m[kRegressionValues], map_slopes[3][kRegressionValues];
    map.spline(p, m, map_slopes);
    const Points<V> a = map.apply(0, p, Points<V>{m[0], m[1], m[2]});
    const Points<V> b = map.apply(1, p, Points<V>{m[4], m[5], m[6]});
    const V progress = m[3], remaining = 1.0f - progress;
    const auto slope_a = from.slope(a, from.detail_share(progress));
    const auto slope_b = to.slope(b, to.detail_share(remaining));
    const Points<V>& gradient_a = slope_a.gradient;
    const Points<V>& gradient_b = slope_b.gradient;
    const V from_distance = from_scale * slope_a.value;
    const V to_distance = to_scale * slope_b.value;
    const V from_weight = from_scale / inv_slope(from_distance);
    const V to_weight = to_scale / inv_slope(to_distance);
    const V weight_b = smoothstep(progress);  // b of the formula above
    // Derivatives of S(D_A) and S(D_B) by t, because the shares of detail depend on t, too.
    const V detail_a_dt =
        from_weight * slope_a.detail_derivative * from.detail_share_slope(progress);
    const V detail_b_dt = to_weight * slope_b.detail_derivative * -to.detail_share_slope(remaining);
    const V df_dt = fma(smoothstep_slope(progress), compress(to_distance) - compress(from_distance),
                        fma(weight_b, detail_b_dt - detail_a_dt, detail_a_dt));
    const auto negated_derivative = [&](int axis) {
      const auto map_slope = [&](int i) { return map_slopes[axis][i]; };
      // The chain rule: the distance's gradient times the map's derivative along the axis.
      const auto pulled_back_slope = [&](const AffineMap& affine, int first,
                                         const Points<V>& gradient) {
        const auto row_derivative = [&](int i) {
          const Vec3 row = affine.rows[i];
          return map_slope(first + i) + (axis == 0 ? row.x : axis == 1 ? row.y : row.z);
        };
        return fma(gradient.x, row_derivative(0),
                   fma(gradient.y, row_derivative(1), gradient.z * row_derivative(2)));
      };
      const V from_slope = from_weight * pulled_back_slope(map.affine[0], 0, gradient_a);
      const V to_slope = to_weight * pulled_back_slope(map.affine[1], 4, gradient_b);
      const V map_term = fma(weight_b, to_slope - from_slope, fma(df_dt, map_slope(3), from_slope));
      return fma(broadcast<V>(level), map_slope(7), -map_term);
    };
    return {negated_derivative(0), negated_derivative(1), negated_derivative(2)};
  }
};

/// Bounds of a MorphField (level_set.h). They follow from the distances, the progress and the
/// weight in the middle of a box, and from how far each of these can change within the box.
struct MorphBounds {
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
    const Grid& lattice = field.map.lattice;
    const float origin[3] = {lattice.origin.x, lattice.origin.y, lattice.origin.z};
    const float low[3] = {box.low.x, box.low.y, box.low.z};
    const float high[3] = {box.high.x, box.high.y, box.high.z};
    const int points[3] = {lattice.points.x, lattice.points.y, lattice.points.z};
    int first[3], last_window[3];
    for (int axis = 0; axis < 3; ++axis) {
      const SplineAxis low_end(low[axis], origin[axis], field.map.inv_spacing, points[axis]);
      const SplineAxis high_end(high[axis], origin[axis], field.map.inv_spacing, points[axis]);
      // Three nodes contribute at each end of the box. One more is taken on each side, because
      // rounding may assign a point to the next node. These are at least four nodes, as many as a
      // window has.
      first[axis] = low_end.first > 0 ? low_end.first - 1 : 0;
      const int end = high_end.first + 4 < points[axis] ? high_end.first + 4 : points[axis];
      last_window[axis] = end - kStrainWindow;
    }
    // The next window along an axis; the last one ends where the nodes end.
    const auto next = [&](int at, int axis) {
      const int after = at + kStrainWindow;
      return at < last_window[axis] && after > last_window[axis] ? last_window[axis] : after;
    };
    Strain largest;
    for (int z = first[2]; z <= last_window[2]; z = next(z, 2)) {
      for (int y = first[1]; y <= last_window[1]; y = next(y, 1)) {
        for (int x = first[0]; x <= last_window[0]; x = next(x, 0)) {
          const Strain& window =
              strain[x + points[0] * (y + static_cast<std::int64_t>(points[1]) * z)];
          largest.maps = max(largest.maps, window.maps);
          for (int k = 0; k < 2; ++k) largest.fourth[k] = max(largest.fourth[k], window.fourth[k]);
        }
      }
    }
    const auto norm = [](Vec3 v) { return sqrt(dot(v, v)); };
    return {norm(largest.maps), norm(largest.fourth[0]), norm(largest.fourth[1])};
  }

  /// Bounds the field from above and, if that bound is positive, from below. The field grows with
  /// both distances and is linear in b, so that the ends of their ranges suffice. The factor 1.001
  /// and the term 1e-5 allow for rounding, the latter in t and w.
  template <class V>
  PM_HD std::uint32_t crossing_boxes(const Points<V>& middle, Vec3 half, const Local& strain_length,
                                     bool has_rim) const {
    V map_values[kRegressionValues];
    Points<V> a, b;
    field.pull_back(middle, map_values, a, b);
    // How far the distances, t and c w can change from the middle.
    const float radius = 1.001f * sqrt(dot(half, half));
    const float max_change = radius * lipschitz * (affine_norm + strain_length.maps) + rounding;
    const float max_progress_change = radius * strain_length.progress + 1e-5f;
    const float abs_level = field.level < 0 ? -field.level : field.level;
    const float max_level_change = abs_level * (radius * strain_length.weight + 1e-5f) + rounding;
    const V min_progress = map_values[3] - max_progress_change,
            max_progress = map_values[3] + max_progress_change;
    const V min_blend = smoothstep(min_progress), max_blend = smoothstep(max_progress);
    const DistanceField &from = field.from, &to = field.to;
    const auto range_a =
        from.value_range(a, from.detail_share(max_progress), from.detail_share(min_progress));
    const auto range_b = to.value_range(b, to.detail_share(1.0f - min_progress),
                                        to.detail_share(1.0f - max_progress));
    const V level_term = -field.level * map_values[7];
    const V high_a = field.compress(field.from_scale * range_a.high + max_change),
            high_difference = field.compress(field.to_scale * range_b.high + max_change) - high_a;
    const V high =
        max(fma(min_blend, high_difference, high_a), fma(max_blend, high_difference, high_a)) +
        level_term + max_level_change;
    const std::uint32_t can_be_inside = Lanes<V>::bits(high > 0.0f);
    if (has_rim || can_be_inside == 0) return can_be_inside;
    const V low_a = field.compress(field.from_scale * range_a.low - max_change),
            low_difference = field.compress(field.to_scale * range_b.low - max_change) - low_a;
    const V low =
        min(fma(min_blend, low_difference, low_a), fma(max_blend, low_difference, low_a)) +
        level_term - max_level_change;
    return can_be_inside & Lanes<V>::bits(low <= 0.0f);
  }
};

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
