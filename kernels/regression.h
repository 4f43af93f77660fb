// Kernel regression (Nadaraya 1964, Watson 1964): makes a smooth function of space from values at
// scattered samples, as a quadratic B-spline with coefficients on a lattice.
//
// At a node x the value is sum_e k_e(x) v_e(x) / sum_e k_e(x). The kernel k_e is m_e times a sum of
// three Gaussians of deviations s_e, 2 s_e and 4 s_e with heights 1, 0.02 and 0.0005: the wide ones
// keep the function smooth far from all samples. Nodes are coefficients of the spline, which
// reproduces linear functions exactly and smooths others by half a node's spacing.
#pragma once

#include <cstdint>

#include "field.h"
#include "host_device.h"
#include "morph_surface.h"
#include "simd_math.h"
#include "types.h"
#include "view.h"

namespace polymorph {

constexpr int kRegressionValues = 8;  ///< per node: two quadruples
constexpr float kSecondHeight = 0.02f, kThirdHeight = 0.0005f;
/// The least exponent of a wide Gaussian; farther samples count as if they were that far away.
constexpr float kMinKernelExponent = -120.0f;
/// Factor of all kernels, which cancels. It keeps kernels of the least exponent normal numbers.
constexpr float kKernelScale = 0x1p40f;

/// A sample as the kernels read it: 2^(-falloff d^2) is the widest Gaussian.
struct KernelSample {
  Vec3 center;
  float falloff = 0;
  /// kKernelScale times mass times the height of the narrow, the middle and the wide Gaussian
  float mass = 0, second = 0, third = 0;
};

/// Computes the coefficients at the lattice's nodes, kNodes per team. The samples are split into
/// kChunks chunks, each of which has its own sum; the sums are added in order.
struct RegressNodes {
  static constexpr int kThreads = 256;
  static constexpr int kNodes = 16, kChunks = 16, kSums = kRegressionValues + 1;
  struct Scratch {
    alignas(64) float sums[kChunks][kSums][kNodes];
    alignas(64) float x[kNodes], y[kNodes], z[kNodes];  ///< positions of the nodes
  };
  Grid lattice;
  View<const KernelSample> samples;
  View<const BallAttribute> values;  ///< two per sample
  bool sloped = false;
  View<float> nodes;  ///< kRegressionValues each

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t run) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount, kPacks = kNodes / kLanes;
    const std::int64_t count = nodes.size / kRegressionValues;
    team.each(kNodes, [&](int l) {
      const std::int64_t node = run * kNodes + l;
      const auto n = static_cast<std::uint32_t>(node < count ? node : count - 1);
      const auto columns = static_cast<std::uint32_t>(lattice.points.x),
                 rows = static_cast<std::uint32_t>(lattice.points.y);
      const Vec3 p =
          grid_point(lattice, {static_cast<int>(n % columns), static_cast<int>(n / columns % rows),
                               static_cast<int>(n / columns / rows)});
      scratch.x[l] = p.x, scratch.y[l] = p.y, scratch.z[l] = p.z;
    });
    team.sync();
    team.each(kPacks * kChunks, [&](int item) {
      const int first = item % kPacks * kLanes, chunk = item / kPacks;
      const Points<V> at = {Lanes<V>::load(scratch.x + first), Lanes<V>::load(scratch.y + first),
                            Lanes<V>::load(scratch.z + first)};
      V sums[kSums];
      if (sloped) {
        add_chunk<V, true>(at, chunk, sums);
      } else {
        add_chunk<V, false>(at, chunk, sums);
      }
      for (int k = 0; k < kSums; ++k) Lanes<V>::store(scratch.sums[chunk][k] + first, sums[k]);
    });
    team.sync();
    team.each(kNodes, [&](int n) {
      const std::int64_t node = run * kNodes + n;
      if (node >= count) return;
      float sums[kSums] = {};
      for (int c = 0; c < kChunks; ++c) {
        for (int k = 0; k < kSums; ++k) sums[k] = sums[k] + scratch.sums[c][k][n];
      }
      for (int k = 0; k < kRegressionValues; ++k) {
        nodes[node * kRegressionValues + k] = sums[k] / sums[kRegressionValues];
      }
    });
  }

  /// Sums kernel times values over the samples of a chunk, and last the kernels.
  template <class V, bool kSloped>
  PM_HD void add_chunk(const Points<V>& at, int chunk, V (&sums)[kSums]) const {
    for (int k = 0; k < kSums; ++k) sums[k] = broadcast<V>(0.0f);
    const std::int64_t chunk_size = (samples.size + kChunks - 1) / kChunks,
                       begin = chunk * chunk_size;
    const std::int64_t end = begin + chunk_size < samples.size ? begin + chunk_size : samples.size;
    for (std::int64_t e = begin; e < end; ++e) {
      const KernelSample& sample = samples[e];
      const V dx = at.x - sample.center.x, dy = at.y - sample.center.y, dz = at.z - sample.center.z;
      const V d2 = fma(dz, dz, fma(dy, dy, dx * dx));
      // The limit keeps the argument in the range of exp2().
      const V exponent = max(d2 * -sample.falloff, broadcast<V>(kMinKernelExponent));
      const V wide = exp2(exponent);
      // The narrower Gaussians are wide^4 and wide^16. Where one would be below the normal numbers,
      // with which processors are slow, it is 0 instead: rounding loses it beside the wide one.
      const V normal = zero_unless(exponent > -31.0f, wide), normal2 = normal * normal,
              middle = normal2 * normal2;
      const V middle_normal = zero_unless(exponent > -7.75f, middle),
              middle2 = middle_normal * middle_normal, narrow = middle2 * middle2;
      const V kernel = fma(narrow, broadcast<V>(sample.mass),
                           fma(middle, broadcast<V>(sample.second), wide * sample.third));
      const BallAttribute* attributes = values.data + 2 * e;
      for (int i = 0; i < kRegressionValues; ++i) {
        const BallAttribute& attribute = attributes[i / 4];
        if constexpr (kSloped) {
          const Vec3 slope = attribute.slope[i % 4];
          V local_value = fma(broadcast<V>(slope.z), dz, broadcast<V>(attribute.value[i % 4]));
          local_value = fma(broadcast<V>(slope.x), dx, fma(broadcast<V>(slope.y), dy, local_value));
          sums[i] = fma(kernel, local_value, sums[i]);
        } else {
          sums[i] = fma(kernel, broadcast<V>(attribute.value[i % 4]), sums[i]);
        }
      }
      sums[kRegressionValues] = sums[kRegressionValues] + kernel;
    }
  }
};

/// The three nodes along an axis that contribute at a coordinate, and their weights, per lane of V.
template <class V>
struct SplineAxisOf {
  decltype(to_index(V{})) middle;  ///< index of the second node
  V weight[3], slope[3];           ///< slope: derivative of the weight, per spacing of nodes

  PM_HD SplineAxisOf(V p, float origin, float inv_spacing, int nodes) {
    const V u = (p - origin) * inv_spacing;
    const V nearest = round_to_nearest(
        min(max(u, broadcast<V>(1.0f)), broadcast<V>(static_cast<float>(nodes - 2))));
    const V f = min(max(u - nearest, broadcast<V>(-0.5f)), broadcast<V>(0.5f));
    middle = to_index(nearest);
    const V low = 0.5f - f, high = 0.5f + f;
    weight[0] = 0.5f * (low * low), weight[2] = 0.5f * (high * high);
    weight[1] = 1.0f - weight[0] - weight[2];
    slope[0] = -low, slope[1] = low - high, slope[2] = high;
  }
};
struct SplineAxis : SplineAxisOf<float> {
  int first = 0;

  PM_HD SplineAxis(float p, float origin, float inv_spacing, int nodes)
      : SplineAxisOf<float>(p, origin, inv_spacing, nodes), first(static_cast<int>(middle) - 1) {}
};

/// The spline as the kernels read it, with the affine maps. It has eight values at a point: a
/// quadruple of each map.
struct SmoothMap {
  Grid lattice;
  float inv_spacing = 1;
  const float* nodes = nullptr;
  AffineMap affine[2];

  SmoothMap() = default;
  SmoothMap(const Regression& regression, const float* data)
      : lattice(regression.lattice), inv_spacing(1 / regression.lattice.cell), nodes(data) {
    affine[0] = regression.affine[0], affine[1] = regression.affine[1];
  }

  PM_HD const float* node(int x, int y, int z) const {
    const std::int64_t row = y + static_cast<std::int64_t>(lattice.points.y) * z;
    return nodes + kRegressionValues * (x + lattice.points.x * row);
  }

  /// Evaluates the eight values at one point, without the affine maps; given `slopes`, also their
  /// derivatives along x, y and z.
  PM_HD void spline(Vec3 p, float (&value)[kRegressionValues]) const {
    const SplineAxis x(p.x, lattice.origin.x, inv_spacing, lattice.points.x);
    const SplineAxis y(p.y, lattice.origin.y, inv_spacing, lattice.points.y);
    const SplineAxis z(p.z, lattice.origin.z, inv_spacing, lattice.points.z);
    Values column[3];
    for (int i = 0; i < 3; ++i)
      column[i] = reduce_yz(x.first + i, y.first, z.first, y.weight, z.weight);
    interpolate_x(column, x.weight, value);
  }
  PM_HD void spline(Vec3 p, float (&value)[kRegressionValues],
                    float (&slopes)[3][kRegressionValues]) const {
    const SplineAxis x(p.x, lattice.origin.x, inv_spacing, lattice.points.x);
    const SplineAxis y(p.y, lattice.origin.y, inv_spacing, lattice.points.y);
    const SplineAxis z(p.z, lattice.origin.z, inv_spacing, lattice.points.z);
    Values column[3];
    for (int i = 0; i < 3; ++i)
      column[i] = reduce_yz(x.first + i, y.first, z.first, y.weight, z.weight);
    interpolate_x(column, x.weight, value);
    interpolate_x(column, x.slope, slopes[0]);
    for (int i = 0; i < 3; ++i)
      column[i] = reduce_yz(x.first + i, y.first, z.first, y.slope, z.weight);
    interpolate_x(column, x.weight, slopes[1]);
    for (int i = 0; i < 3; ++i)
      column[i] = reduce_yz(x.first + i, y.first, z.first, y.weight, z.slope);
    interpolate_x(column, x.weight, slopes[2]);
    for (auto& axis : slopes) {
      for (float& slope : axis) slope *= inv_spacing;
    }
  }

#if defined(PM_PACKS)
  using Values = Pack;  ///< the eight values of a node
  static Pack reduce_nodes(const float* at, std::int64_t row, std::int64_t layer, const float* wy,
                           const float* wz) {
    Pack sum = broadcast<Pack>(0.0f);
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) {
        sum = fma(broadcast<Pack>(wy[j] * wz[k]), Lanes<Pack>::load(at + j * row + k * layer), sum);
      }
    }
    return sum;
  }
  static Pack weigh_columns(const Pack* column, const float* wx) {
    return fma(broadcast<Pack>(wx[2]), column[2],
               fma(broadcast<Pack>(wx[1]), column[1], column[0] * wx[0]));
  }
  static void interpolate_x(const Pack (&column)[3], const float* wx, float* out) {
    Lanes<Pack>::store(out, weigh_columns(column, wx));
  }
  /// Evaluates the eight values at eight points of a line along x, without the affine maps. Returns
  /// false, without values, if more than eight nodes contribute to the points.
  bool spline_line(Pack px, float py, float pz, Pack (&values)[kRegressionValues]) const {
    const SplineAxisOf<Pack> x(px, lattice.origin.x, inv_spacing, lattice.points.x);
    const auto begin = static_cast<int>(x.middle[0]) - 1,
               count = static_cast<int>(x.middle[7]) + 2 - begin;
    if (count > 8) return false;
    const SplineAxis y(py, lattice.origin.y, inv_spacing, lattice.points.y);
    const SplineAxis z(pz, lattice.origin.z, inv_spacing, lattice.points.z);
    // At first values[n] holds the values of node n. After the transpose, values[i] holds value i
    // of all nodes.
    for (int n = 0; n < 8; ++n)
      values[n] = n < count ? reduce_yz(begin + n, y.first, z.first, y.weight, z.weight) : Pack{};
    transpose(values);
    const PackBits first = x.middle - static_cast<std::uint32_t>(begin + 1);
    for (Pack& value : values) {
      const Pack row = value;
      value = fma(x.weight[2], permute(row, first + 2u),
                  fma(x.weight[1], permute(row, first + 1u), permute(row, first) * x.weight[0]));
    }
    return true;
  }
#else
  struct Values {
    float v[kRegressionValues];
  };
  PM_HD static Values reduce_nodes(const float* at, std::int64_t row, std::int64_t layer,
                                   const float* wy, const float* wz) {
    Values sum = {};
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) {
        const float w = wy[j] * wz[k];
        const float* from = at + j * row + k * layer;
        for (int i = 0; i < kRegressionValues; ++i) sum.v[i] = fma(w, from[i], sum.v[i]);
      }
    }
    return sum;
  }
  PM_HD static void interpolate_x(const Values (&column)[3], const float* wx, float* out) {
    for (int i = 0; i < kRegressionValues; ++i) {
      out[i] = fma(wx[2], column[2].v[i], fma(wx[1], column[1].v[i], column[0].v[i] * wx[0]));
    }
  }
#endif
  /// Sums the values of the 3 x 3 nodes at index x, weighted along y and z.
  PM_HD Values reduce_yz(int x, int y, int z, const float* wy, const float* wz) const {
    const std::int64_t row = std::int64_t{kRegressionValues} * lattice.points.x;
    return reduce_nodes(node(x, y, z), row, row * lattice.points.y, wy, wz);
  }

  /// Returns the image of p under a map (0 or 1): its affine image plus `value`, the map's first
  /// three values.
  template <class V>
  PM_HD Points<V> apply(int map, const Points<V>& p, const Points<V>& value) const {
    const AffineMap& a = affine[map];
    const auto along = [&](Vec3 row, float offset, V v) {
      return fma(broadcast<V>(row.x), p.x,
                 fma(broadcast<V>(row.y), p.y, fma(broadcast<V>(row.z), p.z, v + offset)));
    };
    return {along(a.rows[0], a.offset.x, value.x), along(a.rows[1], a.offset.y, value.y),
            along(a.rows[2], a.offset.z, value.z)};
  }
};

/// Bounds of the spline's derivatives around a node along each axis, per scene unit.
struct Strain {
  Vec3 maps;       ///< derivatives of the maps' first three values, without the affine maps
  Vec3 fourth[2];  ///< derivatives of each map's fourth value
};

/// Computes the Strain around each node. The spline's derivatives lie between the differences of
/// neighbouring nodes. One item per node.
struct BoundStrain {
  Grid lattice;
  View<const float> nodes;
  float scale[2] = {1, 1};  ///< factor of each map's first three values
  View<Strain> strain;

  PM_HD void operator()(std::int64_t n) const {
    if (n >= strain.size) return;
    const std::int64_t row = lattice.points.x, layer = row * lattice.points.y;
    const float* at = nodes.data + n * kRegressionValues;
    // The last node along an axis has no next node. It takes itself, so that the difference is 0.
    const float* next[3] = {
        at + kRegressionValues * (n % row + 1 < row ? 1 : 0),
        at + kRegressionValues * (n / row % lattice.points.y + 1 < lattice.points.y ? row : 0),
        at + kRegressionValues * (n / layer + 1 < lattice.points.z ? layer : 0)};
    const auto along_axes = [&](const auto& change) {
      return Vec3{change(next[0]), change(next[1]), change(next[2])} / lattice.cell;
    };
    const auto distance = [&](const float* b, int i) {
      const Vec3 d = {b[i] - at[i], b[i + 1] - at[i + 1], b[i + 2] - at[i + 2]};
      return sqrt(dot(d, d));
    };
    const auto fourth = [&](int i) {
      return along_axes([&](const float* b) { return max(b[i] - at[i], at[i] - b[i]); });
    };
    strain[n] = {along_axes([&](const float* b) {
                   return max(scale[0] * distance(b, 0), scale[1] * distance(b, 4));
                 }),
                 {fourth(3), fourth(7)}};
  }
};

}  // namespace polymorph
