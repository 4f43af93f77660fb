// Kernel regression (Nadaraya 1964, Watson 1964): makes a smooth function of space from values at
// scattered samples, as a quadratic B-spline with coefficients on a lattice.
//
// At a node x the value is sum_e k_e(x) v_e(x) / sum_e k_e(x), where v_e is the value of sample e.
// The kernel k_e is m_e times a sum of three Gaussians of deviations s_e, 2 s_e and 4 s_e with
// heights 1, 0.02 and 0.0005: the wide ones keep the function smooth far from all samples. The
// values at nodes are the spline's coefficients. So the spline reproduces linear functions exactly
// and smooths others, with a deviation of half the nodes' spacing.
#pragma once

#include <cstdint>
#include <cstring>

#include "field.h"
#include "host_device.h"
#include "morph_surface.h"
#include "simd_math.h"
#include "tree.h"
#include "types.h"
#include "view.h"

namespace polymorph {

constexpr int kRegressionValues = 8;  ///< per node: two quadruples
/// Heights of the middle and of the wide Gaussian; that of the narrow one is 1.
constexpr float kSecondHeight = 0.02f, kThirdHeight = 0.0005f;
/// The least exponent (base 2) of a wide Gaussian; farther samples get the weight of this one.
constexpr float kMinKernelExponent = -120.0f;
/// Factor of all kernels, which cancels. With it, kernels of the least exponent are not denormal.
constexpr float kKernelScale = 0x1p40f;

/// A sample as the kernels read it: 2^(-falloff d^2) is the widest Gaussian.
struct alignas(16) KernelSample {  // a GPU loads four floats at once
  Vec3 center;
  float falloff = 0;
  /// kKernelScale times the sample's mass times the height of each Gaussian, the narrow one first.
  float mass = 0, second = 0, third = 0;
};

/// On a GPU a copy, which is loaded four floats at once; on a CPU a reference, whose floats are
/// broadcast to packs from memory.
#if defined(__CUDA_ARCH__)
template <class T>
using LoadedOnce = const T;
#else
template <class T>
using LoadedOnce = const T&;
#endif

/// Computes the coefficients at nodes of the lattice, kNodes per team. A team's threads share the
/// samples: these are split into kChunks chunks, each of which has its own sums. The chunks' sums
/// are added in a fixed order.
template <class Team>
struct RegressNodes {
  /// Seven teams on a multiprocessor leave 72 registers to each thread.
  static constexpr int kThreads = 128, kMinTeams = 7;
  static constexpr int kLanes = Lanes<typename Team::V>::kCount;
  /// Packs of nodes that a thread sums at once. A GPU's thread loads a sample for three nodes: the
  /// teams of a lattice of 28^3 nodes are then as many as the 132 multiprocessors of an H200 hold
  /// at once, and none runs when most others have ended.
  static constexpr int kAtOnce = kLanes == 1 ? 3 : 1;
  static constexpr int kNodes = kLanes == 1 ? 24 : 16, kChunks = 16, kSums = kRegressionValues + 1;
  struct Scratch {
    alignas(64) float sums[kChunks][kSums][kNodes];
    alignas(64) float x[kNodes], y[kNodes], z[kNodes];  ///< positions of the nodes
  };
  Grid lattice;
  View<const KernelSample> samples;
  View<const BallAttribute> values;  ///< two per sample
  bool sloped = false;
  View<float> nodes;                 ///< kRegressionValues each
  View<const std::uint32_t> listed;  ///< indices of the nodes to be computed; empty: all

  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t team_index) const {
    using V = typename Team::V;
    constexpr int kPacks = kNodes / kLanes / kAtOnce;
    const std::int64_t count = listed.size > 0 ? listed.size : nodes.size / kRegressionValues;
    const auto node_at = [&](std::int64_t i) {
      return listed.size > 0 ? listed[i] : static_cast<std::uint32_t>(i);
    };
    team.each(kNodes, [&](int l) {
      const std::int64_t i = team_index * kNodes + l;
      // Lanes beyond the last node repeat it.
      const std::uint32_t n = node_at(i < count ? i : count - 1);
      const auto columns = static_cast<std::uint32_t>(lattice.points.x),
                 rows = static_cast<std::uint32_t>(lattice.points.y);
      const Vec3 p =
          grid_point(lattice, {static_cast<int>(n % columns), static_cast<int>(n / columns % rows),
                               static_cast<int>(n / columns / rows)});
      scratch.x[l] = p.x, scratch.y[l] = p.y, scratch.z[l] = p.z;
    });
    team.sync();
    team.each(kPacks * kChunks, [&](int item) {
      const int chunk = item / kPacks;
      const auto first = [&](int pack) { return (item % kPacks + kPacks * pack) * kLanes; };
      Points<V> at[kAtOnce];
      for (int i = 0; i < kAtOnce; ++i) {
        at[i] = {Lanes<V>::load(scratch.x + first(i)), Lanes<V>::load(scratch.y + first(i)),
                 Lanes<V>::load(scratch.z + first(i))};
      }
      V sums[kAtOnce][kSums];
      if (sloped) {
        add_chunk<true>(at, chunk, sums);
      } else {
        add_chunk<false>(at, chunk, sums);
      }
      for (int i = 0; i < kAtOnce; ++i) {
        for (int k = 0; k < kSums; ++k)
          Lanes<V>::store(scratch.sums[chunk][k] + first(i), sums[i][k]);
      }
    });
    team.sync();
    // The sums of all chunks replace those of the first one.
    team.each(kSums * kNodes / kLanes, [&](int item) {
      const int k = item % kSums, first = item / kSums * kLanes;
      V sum = broadcast<V>(0.0f);
      for (int c = 0; c < kChunks; ++c) sum = sum + Lanes<V>::load(scratch.sums[c][k] + first);
      Lanes<V>::store(scratch.sums[0][k] + first, sum);
    });
    team.sync();
    team.each(kRegressionValues * kNodes / kLanes, [&](int item) {
      const int k = item % kRegressionValues, first = item / kRegressionValues * kLanes;
      alignas(64) float value[kLanes];
      Lanes<V>::store(value, Lanes<V>::load(scratch.sums[0][k] + first) /
                                 Lanes<V>::load(scratch.sums[0][kRegressionValues] + first));
      for (int l = 0; l < kLanes; ++l) {
        const std::int64_t i = team_index * kNodes + first + l;
        if (i < count) nodes[std::int64_t{node_at(i)} * kRegressionValues + k] = value[l];
      }
    });
  }

  /// Sums over the samples of a chunk at kAtOnce packs of nodes: sums[n][i] is the sum of kernel
  /// times value i at pack n, and the last element that of the kernels.
  template <bool kSloped, class V>
  PM_HD void add_chunk(const Points<V> (&at)[kAtOnce], int chunk, V (&sums)[kAtOnce][kSums]) const {
    for (int n = 0; n < kAtOnce; ++n) {
      for (int k = 0; k < kSums; ++k) sums[n][k] = broadcast<V>(0.0f);
    }
    const std::int64_t chunk_size = (samples.size + kChunks - 1) / kChunks,
                       begin = chunk * chunk_size;
    const std::int64_t end = begin + chunk_size < samples.size ? begin + chunk_size : samples.size;
    for (std::int64_t e = begin; e < end; ++e) {
      LoadedOnce<KernelSample> sample = samples[e];
      Points<V> offset[kAtOnce];
      V kernel[kAtOnce];
      for (int n = 0; n < kAtOnce; ++n) {
        offset[n] = {at[n].x - sample.center.x, at[n].y - sample.center.y,
                     at[n].z - sample.center.z};
        kernel[n] = kernel_at(sample, offset[n]);
      }
      for (int m = 0; m < kRegressionValues / 4; ++m) {
        LoadedOnce<BallAttribute> attribute = values[2 * e + m];
        for (int i = 0; i < 4; ++i) {
          for (int n = 0; n < kAtOnce; ++n) {
            V& sum = sums[n][4 * m + i];
            if constexpr (kSloped) {
              const Vec3 slope = attribute.slope[i];
              V local_value =
                  fma(broadcast<V>(slope.z), offset[n].z, broadcast<V>(attribute.value[i]));
              local_value = fma(broadcast<V>(slope.x), offset[n].x,
                                fma(broadcast<V>(slope.y), offset[n].y, local_value));
              sum = fma(kernel[n], local_value, sum);
            } else {
              sum = fma(kernel[n], broadcast<V>(attribute.value[i]), sum);
            }
          }
        }
      }
      for (int n = 0; n < kAtOnce; ++n)
        sums[n][kRegressionValues] = sums[n][kRegressionValues] + kernel[n];
    }
  }

  /// Evaluates the kernel of a sample at nodes, given their offsets from its centre.
  template <class V>
  PM_HD static V kernel_at(const KernelSample& sample, const Points<V>& offset) {
    const V d2 = fma(offset.z, offset.z, fma(offset.y, offset.y, offset.x * offset.x));
    // The limit keeps the argument in the range of exp2().
    const V exponent = max(d2 * -sample.falloff, broadcast<V>(kMinKernelExponent));
    const V wide = exp2(exponent);
    // The narrower Gaussians are wide^4 and wide^16. Below 2^-124 each becomes 0, because
    // denormal numbers would be slow; rounding would lose so small a term beside the wide
    // Gaussian anyway.
    const V wide_or_zero = zero_unless(exponent > -31.0f, wide),
            wide2 = wide_or_zero * wide_or_zero, middle = wide2 * wide2;
    const V middle_or_zero = zero_unless(exponent > -7.75f, middle),
            middle2 = middle_or_zero * middle_or_zero, narrow = middle2 * middle2;
    return fma(narrow, broadcast<V>(sample.mass),
               fma(middle, broadcast<V>(sample.second), wide * sample.third));
  }
};

/// The three nodes along an axis that contribute at a coordinate, and their weights, per lane of V.
/// The weights of a quadratic B-spline are (1/2 - f)^2 / 2, 3/4 - f^2 and (1/2 + f)^2 / 2, where f
/// in
/// [-1/2, 1/2] is the offset from the middle node in spacings.
template <class V>
struct SplineAxisOf {
  decltype(to_index(V{})) middle;  ///< index of the second node, from 1 to nodes - 2
  V weight[3], slope[3];           ///< slope: derivative of the weight by f

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
/// SplineAxisOf for a single coordinate.
struct SplineAxis : SplineAxisOf<float> {
  int first = 0;  ///< index of the first node

  PM_HD SplineAxis(float p, float origin, float inv_spacing, int nodes)
      : SplineAxisOf<float>(p, origin, inv_spacing, nodes), first(static_cast<int>(middle) - 1) {}
};

constexpr int kQuadruples = kRegressionValues / 4;  ///< per node
/// Four values of a node or of a column. A GPU loads them at once.
struct alignas(16) Quadruple {
  float v[4];
  /// Adds the four values of a node from `node` on, times a weight.
  PM_HD void add(const float* node, float weight) {
    const Quadruple four = *reinterpret_cast<const Quadruple*>(node);
    for (int i = 0; i < 4; ++i) v[i] = fma(weight, four.v[i], v[i]);
  }
};
/// Writes the weighted sum of the four values of three columns.
PM_HD inline void interpolate_columns(const Quadruple& low, const Quadruple& middle,
                                      const Quadruple& high, const float (&weight)[3], float* out) {
  for (int i = 0; i < 4; ++i)
    out[i] = fma(weight[2], high.v[i], fma(weight[1], middle.v[i], low.v[i] * weight[0]));
}

/// Three neighbouring columns of nodes, the eight values of each summed over y and z. add() adds a
/// row's three nodes from `node` on, times a weight; interpolate() writes the weighted sum of the
/// columns. The variants have different names, because the linker may merge functions of
/// one name: files that g++ compiles and those that nvcc compiles are linked together.
#if defined(PM_WIDE_PACKS)
struct WideNodeColumns {
  WidePack low;  ///< two columns
  Pack high;
  void add(const float* node, float weight) {
    low = fma(broadcast<WidePack>(weight), Lanes<WidePack>::load(node), low);
    high = fma(broadcast<Pack>(weight), Lanes<Pack>::load(node + 2 * kRegressionValues), high);
  }
  void interpolate(float w0, float w1, float w2, float* out) const {
    const Pack sum = fma(broadcast<Pack>(w1), high_half(low), low_half(low) * w0);
    Lanes<Pack>::store(out, fma(broadcast<Pack>(w2), high, sum));
  }
};
using NodeColumns = WideNodeColumns;
#elif defined(PM_PACKS)
struct PackNodeColumns {
  Pack column[3];
  void add(const float* node, float weight) {
    for (int i = 0; i < 3; ++i) {
      column[i] =
          fma(broadcast<Pack>(weight), Lanes<Pack>::load(node + kRegressionValues * i), column[i]);
    }
  }
  void interpolate(float w0, float w1, float w2, float* out) const {
    const Pack sum = fma(broadcast<Pack>(w1), column[1], column[0] * w0);
    Lanes<Pack>::store(out, fma(broadcast<Pack>(w2), column[2], sum));
  }
};
using NodeColumns = PackNodeColumns;
#else
struct ScalarNodeColumns {
  Quadruple column[3][kQuadruples];
  PM_HD void add(const float* node, float weight) {
    for (int i = 0; i < 3; ++i) {
      for (int q = 0; q < kQuadruples; ++q)
        column[i][q].add(node + kRegressionValues * i + 4 * q, weight);
    }
  }
  PM_HD void interpolate(float w0, float w1, float w2, float* out) const {
    for (int q = 0; q < kQuadruples; ++q)
      interpolate_columns(column[0][q], column[1][q], column[2][q], {w0, w1, w2}, out + 4 * q);
  }
};
using NodeColumns = ScalarNodeColumns;
#endif

/// A regression's spline and affine maps as the kernels read them. The spline has eight values at a
/// point, a quadruple for each map.
struct SmoothMap {
  Grid lattice;
  float inv_spacing = 1;
  const float* nodes = nullptr;  ///< kRegressionValues coefficients per node, x fastest
  AffineMap affine[2];

  SmoothMap() = default;
  SmoothMap(const Regression& regression, const float* data)
      : lattice(regression.lattice), inv_spacing(1 / regression.lattice.cell), nodes(data) {
    affine[0] = regression.affine[0], affine[1] = regression.affine[1];
  }

  /// Evaluates the eight values at points, without the affine maps.
  template <class V, class Columns = NodeColumns>
  PM_HD void spline(const Points<V>& p, V (&value)[kRegressionValues]) const {
    constexpr int kLanes = Lanes<V>::kCount;
    const SplineNodes<V> stencil(*this, p);
    alignas(64) float weights[9][kLanes], values[kLanes][kRegressionValues];
    stencil.weigh(stencil.y.weight, stencil.z.weight, weights);
    for (int l = 0; l < kLanes; ++l) {
      Columns columns = {};
      for_nodes(nodes + stencil.first[l],
                [&](const float* node, int n) { columns.add(node, weights[n][l]); });
      columns.interpolate(stencil.x_weights[0][l], stencil.x_weights[1][l], stencil.x_weights[2][l],
                          values[l]);
    }
    load_columns(values, value);
  }
  /// Evaluates the four values of one map at one point.
  PM_HD void spline(const Points<float>& p, int of_map, float (&value)[4]) const {
    const SplineNodes<float> stencil(*this, p);
    Quadruple columns[3] = {};
    for_nodes(nodes + stencil.first[0] + 4 * of_map, [&](const float* node, int n) {
      const float weight = stencil.y.weight[n % 3] * stencil.z.weight[n / 3];
      for (int i = 0; i < 3; ++i) columns[i].add(node + kRegressionValues * i, weight);
    });
    interpolate_columns(columns[0], columns[1], columns[2], stencil.x.weight, value);
  }
  /// Evaluates the four values of one map at one point, and their derivatives along x, y and z.
  PM_HD void spline(const Points<float>& p, int of_map, float (&value)[4],
                    float (&slopes)[3][4]) const {
    evaluate_map(SplineNodes<float>(*this, p), of_map, value, slopes);
    for (int axis = 0; axis < 3; ++axis) {
      for (float& slope : slopes[axis]) slope = slope * inv_spacing;
    }
  }
  /// Evaluates the values, and their derivatives along x, y and z.
  template <class V, class Columns = NodeColumns>
  PM_HD void spline(const Points<V>& p, V (&value)[kRegressionValues],
                    V (&slopes)[3][kRegressionValues]) const {
    constexpr int kLanes = Lanes<V>::kCount;
    const SplineNodes<V> stencil(*this, p);
    if constexpr (kLanes == 1) {
      // A map at a time, because a GPU's thread has too few registers for the sums of both.
      for (int m = 0; m < kQuadruples; ++m) {
        float map_slopes[3][4];
        evaluate_map(stencil, m, value + 4 * m, map_slopes);
        for (int axis = 0; axis < 3; ++axis)
          for (int i = 0; i < 4; ++i) slopes[axis][4 * m + i] = map_slopes[axis][i];
      }
    } else {
      // [0]: for the values and their derivatives by x; [1]: by y; [2]: by z.
      alignas(64) float weights[3][9][kLanes], x_slopes[3][kLanes];
      stencil.weigh(stencil.y.weight, stencil.z.weight, weights[0]);
      stencil.weigh(stencil.y.slope, stencil.z.weight, weights[1]);
      stencil.weigh(stencil.y.weight, stencil.z.slope, weights[2]);
      for (int i = 0; i < 3; ++i) Lanes<V>::store(x_slopes[i], stencil.x.slope[i]);
      // [0]: the values; [1] to [3]: their derivatives by x, y and z.
      alignas(64) float values[4][kLanes][kRegressionValues];
      for (int l = 0; l < kLanes; ++l) {
        Columns columns[3] = {};
        for_nodes(nodes + stencil.first[l], [&](const float* node, int n) {
          for (int i = 0; i < 3; ++i) columns[i].add(node, weights[i][n][l]);
        });
        const float w0 = stencil.x_weights[0][l], w1 = stencil.x_weights[1][l],
                    w2 = stencil.x_weights[2][l];
        columns[0].interpolate(w0, w1, w2, values[0][l]);
        columns[0].interpolate(x_slopes[0][l], x_slopes[1][l], x_slopes[2][l], values[1][l]);
        columns[1].interpolate(w0, w1, w2, values[2][l]);
        columns[2].interpolate(w0, w1, w2, values[3][l]);
      }
      load_columns(values[0], value);
      for (int axis = 0; axis < 3; ++axis) load_columns(values[axis + 1], slopes[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (V& slope : slopes[axis]) slope = slope * inv_spacing;
    }
  }

  /// Returns the image of p under a map (0 or 1): its affine image plus `value`, the first three of
  /// the map's spline values at p.
  template <class V>
  PM_HD Points<V> apply(int map, const Points<V>& p, const Points<V>& value) const {
    const AffineMap& a = affine[map];
    const auto coordinate = [&](Vec3 row, float offset, V v) {
      return fma(broadcast<V>(row.x), p.x,
                 fma(broadcast<V>(row.y), p.y, fma(broadcast<V>(row.z), p.z, v + offset)));
    };
    return {coordinate(a.rows[0], a.offset.x, value.x), coordinate(a.rows[1], a.offset.y, value.y),
            coordinate(a.rows[2], a.offset.z, value.z)};
  }

 private:
  /// The 3 x 3 x 3 nodes that contribute at each of several points.
  template <class V>
  struct SplineNodes {
    static constexpr int kLanes = Lanes<V>::kCount;
    SplineAxisOf<V> x, y, z;
    alignas(64) std::uint32_t first[kLanes];  ///< index of the lowest node's first value
    alignas(64) float x_weights[3][kLanes];

    PM_HD SplineNodes(const SmoothMap& map, const Points<V>& p)
        : x(p.x, map.lattice.origin.x, map.inv_spacing, map.lattice.points.x),
          y(p.y, map.lattice.origin.y, map.inv_spacing, map.lattice.points.y),
          z(p.z, map.lattice.origin.z, map.inv_spacing, map.lattice.points.z) {
      const auto columns = static_cast<std::uint32_t>(map.lattice.points.x),
                 rows = static_cast<std::uint32_t>(map.lattice.points.y);
      const auto node = x.middle + columns * (y.middle + rows * z.middle);
      const auto begin = kRegressionValues * (node - (1 + columns * (1 + rows)));
      std::memcpy(first, &begin, sizeof begin);
      for (int i = 0; i < 3; ++i) Lanes<V>::store(x_weights[i], x.weight[i]);
    }
    /// Writes the products of the weights along y and z, in the order of for_nodes().
    PM_HD void weigh(const V (&along_y)[3], const V (&along_z)[3], float (*out)[kLanes]) const {
      for (int k = 0; k < 3; ++k) {
        for (int j = 0; j < 3; ++j) Lanes<V>::store(out[3 * k + j], along_y[j] * along_z[k]);
      }
    }
  };

  /// Evaluates the values and derivatives (not yet divided by the spacing) of one map at one point.
  PM_HD void evaluate_map(const SplineNodes<float>& stencil, int of_map, float* value,
                          float (&slopes)[3][4]) const {
    const auto &x = stencil.x, &y = stencil.y, &z = stencil.z;
    // [0]: for the values and their derivatives by x; [1]: by y; [2]: by z; each for three columns.
    Quadruple sums[3][3] = {};
    for_nodes(nodes + stencil.first[0] + 4 * of_map, [&](const float* node, int n) {
      const int j = n % 3, k = n / 3;
      const float weights[3] = {y.weight[j] * z.weight[k], y.slope[j] * z.weight[k],
                                y.weight[j] * z.slope[k]};
      for (int column = 0; column < 3; ++column) {
        for (int i = 0; i < 3; ++i)
          sums[i][column].add(node + kRegressionValues * column, weights[i]);
      }
    });
    const auto interpolate = [](const Quadruple(&columns)[3], const float(&weight)[3], float* out) {
      interpolate_columns(columns[0], columns[1], columns[2], weight, out);
    };
    interpolate(sums[0], x.weight, value);
    interpolate(sums[0], x.slope, slopes[0]);
    interpolate(sums[1], x.weight, slopes[1]);
    interpolate(sums[2], x.weight, slopes[2]);
  }

  /// Calls f(node, n) for the 3 x 3 nodes along y and z from `node` on, n = 0 to 8, y fastest.
  template <class F>
  PM_HD void for_nodes(const float* node, const F& f) const {
    const std::int64_t row = std::int64_t{kRegressionValues} * lattice.points.x,
                       layer = row * lattice.points.y;
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) f(node + j * row + k * layer, 3 * k + j);
    }
  }

  /// Transposes: value i of each lane, lanes[l][i], becomes lane l of out[i].
  PM_HD static void load_columns(const float (*lanes)[kRegressionValues],
                                 float (&out)[kRegressionValues]) {
    for (int i = 0; i < kRegressionValues; ++i) out[i] = lanes[0][i];
  }
#if defined(PM_PACKS)
  static void load_columns(const float (*lanes)[kRegressionValues],
                           Pack (&out)[kRegressionValues]) {
    for (int l = 0; l < 8; ++l) out[l] = Lanes<Pack>::load(lanes[l]);
    transpose(out);
  }
#endif
#if defined(PM_WIDE_PACKS)
  static void load_columns(const float (*lanes)[kRegressionValues],
                           WidePack (&out)[kRegressionValues]) {
    Pack low[kRegressionValues], high[kRegressionValues];
    load_columns(lanes, low), load_columns(lanes + 8, high);
    for (int i = 0; i < kRegressionValues; ++i) out[i] = join(low[i], high[i]);
  }
#endif
  friend struct PackBrickSpline;
  friend struct TeamBrickSpline;
};

#if defined(PM_PACKS)
/// Evaluates a SmoothMap's spline at some of the 8^3 points of a box that is aligned with the axes,
/// such as a brick. The points of a line along x share sums of nodes over y and z (columns), which
/// are computed for those lines alone that have a point to be evaluated.
struct PackBrickSpline {
  static constexpr int kPoints = kBrickPoints;
  static constexpr int kMaxColumns = 8;  ///< the most nodes along x
  struct Scratch {
    /// Per line and node along x, the eight values summed over y and z.
    alignas(64) float columns[kPoints * kPoints * kMaxColumns * kRegressionValues];
  };

  /// `at`: the coordinates of the points along each axis, in ascending order.
  PackBrickSpline(Scratch& shared, const SmoothMap& smooth_map, const Points<Pack>& at)
      : scratch(shared), map(smooth_map) {
    const SplineAxisOf<Pack> x(at.x, map.lattice.origin.x, map.inv_spacing, map.lattice.points.x),
        y(at.y, map.lattice.origin.y, map.inv_spacing, map.lattice.points.y),
        z(at.z, map.lattice.origin.z, map.inv_spacing, map.lattice.points.z);
    const int end = static_cast<int>(x.middle[kPoints - 1]) + 2;
    // add_line() loads four nodes at once, which must not reach beyond the row.
    const int lowest = static_cast<int>(x.middle[0]) - 1, last_four = map.lattice.points.x - 4;
    begin = lowest < last_four ? lowest : last_four;
    count = end - begin;
    line_size = kRegressionValues * (count <= 4 ? 4 : kMaxColumns);
    const PackBits first = kRegressionValues * (x.middle - static_cast<std::uint32_t>(begin + 1));
    std::memcpy(column, &first, sizeof column);
    std::memcpy(y_middle, &y.middle, sizeof y_middle);
    std::memcpy(z_middle, &z.middle, sizeof z_middle);
    for (int i = 0; i < 3; ++i) {
      Lanes<Pack>::store(x_weight[i], x.weight[i]);
      Lanes<Pack>::store(y_weight[i], y.weight[i]);
      Lanes<Pack>::store(z_weight[i], z.weight[i]);
    }
  }

  /// Returns whether the other functions may be called, which need at most eight nodes along x.
  bool has_lines() const { return count <= kMaxColumns; }
  /// Prepares lines of points for values(): those that have a bit, that of (y, z) at y + 8 z.
  void add_lines(std::uint64_t lines) {
    for (std::uint64_t missing = lines & ~has_columns; missing != 0; missing &= missing - 1)
      add_line(countr_zero(missing));
    has_columns |= lines;
  }
  /// Evaluates the eight values, without the affine maps, at as many points as V has lanes. The
  /// index of point (x, y, z) is x + 8 (y + 8 z).
  void values(const std::uint32_t* points, Pack (&out)[kRegressionValues]) const {
    for (int l = 0; l < 8; ++l) {
      const std::uint32_t x = points[l] % kPoints;
      const float* at = scratch.columns + line_size * (points[l] / kPoints) + column[x];
      const Pack low = Lanes<Pack>::load(at) * x_weight[0][x],
                 sum = fma(broadcast<Pack>(x_weight[1][x]),
                           Lanes<Pack>::load(at + kRegressionValues), low);
      out[l] =
          fma(broadcast<Pack>(x_weight[2][x]), Lanes<Pack>::load(at + 2 * kRegressionValues), sum);
    }
    transpose(out);
  }
#if defined(PM_WIDE_PACKS)
  void values(const std::uint32_t* points, WidePack (&out)[kRegressionValues]) const {
    Pack low[kRegressionValues], high[kRegressionValues];
    values(points, low), values(points + 8, high);
    for (int i = 0; i < kRegressionValues; ++i) out[i] = join(low[i], high[i]);
  }
#endif

 private:
  void add_line(int line) {
    const int line_y = line % kPoints, line_z = line / kPoints;
    float weights[9];
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) weights[3 * k + j] = y_weight[j][line_y] * z_weight[k][line_z];
    }
    const std::int64_t row = static_cast<std::int64_t>(y_middle[line_y]) - 1 +
                             map.lattice.points.y * (std::int64_t{z_middle[line_z]} - 1);
    const float* nodes = map.nodes + kRegressionValues * (begin + map.lattice.points.x * row);
    float* out = scratch.columns + line_size * static_cast<std::uint32_t>(line);
#if defined(PM_WIDE_PACKS)
    if (count <= 4) {
      WidePack low = {}, high = {};  // the 16 values of two columns each
      map.for_nodes(nodes, [&](const float* node, int i) {
        const WidePack weight = broadcast<WidePack>(weights[i]);
        low = fma(weight, Lanes<WidePack>::load(node), low);
        high = fma(weight, Lanes<WidePack>::load(node + 16), high);
      });
      Lanes<WidePack>::store(out, low), Lanes<WidePack>::store(out + 16, high);
      return;
    }
#endif
    for (int n = 0; n < count; ++n) {
      Pack sum = {};
      map.for_nodes(nodes + kRegressionValues * n, [&](const float* node, int i) {
        sum = fma(broadcast<Pack>(weights[i]), Lanes<Pack>::load(node), sum);
      });
      Lanes<Pack>::store(out + kRegressionValues * n, sum);
    }
  }

  Scratch& scratch;
  const SmoothMap& map;
  int begin, count;               ///< nodes along x that contribute to the box
  std::uint32_t line_size;        ///< floats of a line's columns
  std::uint64_t has_columns = 0;  ///< the lines whose columns are computed
  /// Per point along x: the first value of its first column, counted from the line's first one.
  std::uint32_t column[kPoints];
  std::uint32_t y_middle[kPoints], z_middle[kPoints];
  alignas(32) float x_weight[3][kPoints], y_weight[3][kPoints], z_weight[3][kPoints];
};
#endif

/// Evaluates a SmoothMap's spline at the 8^3 points of a brick. The points of a line along x share
/// sums of nodes over y and z (columns), which the team's threads compute first.
struct TeamBrickSpline {
  static constexpr int kPoints = kBrickPoints;
  static constexpr int kColumns = 4;  ///< the most nodes along x; bricks of fine grids have 3 or 4
  struct Scratch {
    int first[3][kPoints];        ///< per axis and coordinate, the first of its three nodes
    float weight[3][3][kPoints];  ///< the weights of these nodes
    Quadruple columns[kPoints * kPoints][kColumns][kQuadruples];
  };

  /// `first`: the brick's lowest point of `grid`.
  template <class Team>
  PM_HD TeamBrickSpline(const Team& team, Scratch& shared, const SmoothMap& map, const Grid& grid,
                        Int3 first)
      : scratch(shared) {
    const Int3 nodes = map.lattice.points;
    team.each(3 * kPoints, [&](int i) {
      const int axis = i / kPoints, at = i % kPoints;
      const Vec3 p = grid_point(grid, {first.x + at, first.y + at, first.z + at});
      const auto of_axis = [&](auto px, auto py, auto pz) {
        return axis == 0 ? px : axis == 1 ? py : pz;
      };
      const SplineAxis spline(
          of_axis(p.x, p.y, p.z),
          of_axis(map.lattice.origin.x, map.lattice.origin.y, map.lattice.origin.z),
          map.inv_spacing, of_axis(nodes.x, nodes.y, nodes.z));
      scratch.first[axis][at] = spline.first;
      for (int k = 0; k < 3; ++k) scratch.weight[axis][k][at] = spline.weight[k];
    });
    team.sync();
    count = scratch.first[0][kPoints - 1] + 3 - scratch.first[0][0];
    if (!has_lines()) return;
    // An item computes four values of a column.
    team.each(kPoints * kPoints * kColumns * kQuadruples, [&](int item) {
      const int column = item / kQuadruples % kColumns, line = item / kQuadruples / kColumns;
      if (column >= count) return;
      const int y = line % kPoints, z = line / kPoints, quadruple = item % kQuadruples;
      const std::int64_t row =
          scratch.first[1][y] + static_cast<std::int64_t>(nodes.y) * scratch.first[2][z];
      const float* lowest = map.nodes +
                            kRegressionValues * (scratch.first[0][0] + column + nodes.x * row) +
                            4 * quadruple;
      Quadruple sums = {};
      map.for_nodes(lowest, [&](const float* node, int n) {
        sums.add(node, scratch.weight[1][n % 3][y] * scratch.weight[2][n / 3][z]);
      });
      scratch.columns[line][column][quadruple] = sums;
    });
    team.sync();
  }

  /// Returns whether values() may be called.
  PM_HD bool has_lines() const { return count <= kColumns; }
  /// Evaluates the eight values, without the affine maps, at the brick's point `item`.
  PM_HD void values(int item, float (&out)[kRegressionValues]) const {
    const int x = item % kPoints;
    const auto& columns = scratch.columns[item / kPoints];
    const int column = scratch.first[0][x] - scratch.first[0][0];
    for (int q = 0; q < kQuadruples; ++q)
      interpolate_columns(
          columns[column][q], columns[column + 1][q], columns[column + 2][q],
          {scratch.weight[0][0][x], scratch.weight[0][1][x], scratch.weight[0][2][x]}, out + 4 * q);
  }

  Scratch& scratch;
  int count = 0;  ///< nodes along x that contribute to the brick
};

/// Bounds of the spline's derivatives along each axis around a node, per scene unit.
struct Strain {
  /// Length of the derivative of a map's first three values (without the affine map) times
  /// BoundStrain::scale, the larger one of both maps.
  Vec3 maps;
  Vec3 fourth[2];  ///< absolute derivative of each map's fourth value
};

/// Computes the Strain around each node from the differences to the next nodes, because the
/// spline's derivatives lie between differences of neighbouring nodes. One item per node.
struct BoundStrain {
  Grid lattice;
  View<const float> nodes;
  float scale[2] = {1, 1};  ///< factor of the derivatives of each map's first three values
  View<Strain> strain;

  PM_HD void operator()(std::int64_t n) const {
    if (n >= strain.size) return;
    // Divisions of 32 bits are several times as fast on a GPU.
    const auto node = static_cast<std::uint32_t>(n),
               row = static_cast<std::uint32_t>(lattice.points.x),
               rows = static_cast<std::uint32_t>(lattice.points.y);
    strain[n] = at_node({static_cast<int>(node % row), static_cast<int>(node / row % rows),
                         static_cast<int>(node / (row * rows))});
  }
  PM_HD Strain at_node(Int3 node) const {
    const Int3 n = lattice.points;
    const std::int64_t row = n.x, layer = row * n.y;
    const auto* at = reinterpret_cast<const Quadruple*>(nodes.data) +
                     kQuadruples * (node.x + row * node.y + layer * node.z);
    // The last node along an axis has no next node. It takes itself, so that the difference is 0.
    const Quadruple* next[3] = {at + kQuadruples * (node.x + 1 < n.x ? 1 : 0),
                                at + kQuadruples * (node.y + 1 < n.y ? row : 0),
                                at + kQuadruples * (node.z + 1 < n.z ? layer : 0)};
    float maps[3], fourth[2][3];
    for (int axis = 0; axis < 3; ++axis) {
      float distance[kQuadruples];
      for (int m = 0; m < kQuadruples; ++m) {
        const Quadruple a = at[m], b = next[axis][m];
        const Vec3 d = {b.v[0] - a.v[0], b.v[1] - a.v[1], b.v[2] - a.v[2]};
        distance[m] = scale[m] * sqrt(dot(d, d));
        fourth[m][axis] = max(b.v[3] - a.v[3], a.v[3] - b.v[3]) / lattice.cell;
      }
      maps[axis] = max(distance[0], distance[1]) / lattice.cell;
    }
    return {
        {maps[0], maps[1], maps[2]},
        {{fourth[0][0], fourth[0][1], fourth[0][2]}, {fourth[1][0], fourth[1][1], fourth[1][2]}}};
  }
};

constexpr int kStrainWindow = 4;  ///< nodes of a window along an axis

/// Computes the largest values of the nodes n, n + step, ... of a window along one axis. After a
/// pass along each axis, `to` holds the Strain of kStrainWindow^3 nodes from each node on, so that
/// a box of nodes takes few look-ups. Windows beyond the lattice's end are undefined. An item is as
/// many floats as V has lanes; both arrays have kPadding more floats than they need.
template <class V>
struct MaximizeStrain {
  static constexpr int kFloats = sizeof(Strain) / sizeof(float);  ///< per node
  static constexpr int kPadding = 16;
  const float* from = nullptr;
  float* to = nullptr;
  std::int64_t size = 0;  ///< floats
  std::int64_t step = 0;  ///< floats from a node to the next one along the axis

  PM_HD void operator()(std::int64_t item) const {
    const std::int64_t at = item * Lanes<V>::kCount;
    if (at >= size) return;
    V largest = Lanes<V>::load(from + at);
    for (int k = 1; k < kStrainWindow; ++k) {
      const std::int64_t next = at + k * step;
      if (next < size) largest = max(largest, Lanes<V>::load(from + next));
    }
    Lanes<V>::store(to + at, largest);
  }
};

/// Does at once what BoundStrain and three passes of MaximizeStrain do, as a GPU starts one pass
/// sooner than four. A team computes the strain around a tile's windows, and their largest values
/// axis by axis.
struct BoundStrainWindows {
  static constexpr int kThreads = 384;
  static constexpr int kTile = 4;                           ///< windows along an axis, per team
  static constexpr int kNodes = kTile + kStrainWindow - 1;  ///< their nodes along an axis
  static constexpr int kFloats = MaximizeStrain<float>::kFloats;
  struct Scratch {
    Strain strain[kNodes * kNodes * kNodes];
    float along_x[kNodes][kNodes][kTile][kFloats], along_y[kNodes][kTile][kTile][kFloats];
  };
  BoundStrain bound;
  Int3 tiles;  ///< along each axis

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t tile) const {
    const Int3 n = bound.lattice.points;
    const auto t = static_cast<int>(tile);
    const Int3 first = {kTile * (t % tiles.x), kTile * (t / tiles.x % tiles.y),
                        kTile * (t / tiles.x / tiles.y)};
    team.each(kNodes * kNodes * kNodes, [&](int i) {
      const Int3 node = {first.x + i % kNodes, first.y + i / kNodes % kNodes,
                         first.z + i / kNodes / kNodes};
      const bool exists = node.x < n.x && node.y < n.y && node.z < n.z;
      scratch.strain[i] = exists ? bound.at_node(node) : Strain{};
    });
    team.sync();
    // Returns the largest of a window's numbers, which lie `step` floats apart.
    const auto largest = [](const float* at, int step) {
      float out = at[0];
      for (int k = 1; k < kStrainWindow; ++k) out = max(out, at[k * step]);
      return out;
    };
    team.each(kNodes * kNodes * kTile * kFloats, [&](int i) {
      const int k = i % kFloats, x = i / kFloats % kTile, yz = i / kFloats / kTile;
      (&scratch.along_x[0][0][0][0])[i] =
          largest(&scratch.strain[x + kNodes * yz].maps.x + k, kFloats);
    });
    team.sync();
    team.each(kNodes * kTile * kTile * kFloats, [&](int i) {
      const int kx = i % (kFloats * kTile), y = i / (kFloats * kTile) % kTile,
                z = i / (kFloats * kTile * kTile);
      (&scratch.along_y[0][0][0][0])[i] =
          largest(&scratch.along_x[z][y][0][0] + kx, kFloats * kTile);
    });
    team.sync();
    team.each(kTile * kTile * kTile * kFloats, [&](int i) {
      const int k = i % kFloats, x = first.x + i / kFloats % kTile,
                y = first.y + i / (kFloats * kTile) % kTile,
                z = first.z + i / (kFloats * kTile * kTile);
      if (x >= n.x || y >= n.y || z >= n.z) return;
      Strain& to = bound.strain[x + static_cast<std::int64_t>(n.x) * (y + n.y * z)];
      (&to.maps.x)[k] = largest(&scratch.along_y[0][0][0][0] + i, kFloats * kTile * kTile);
    });
  }
};

}  // namespace polymorph
