// Directional albedo of GGX with Schlick's Fresnel term, split as f0 * scale + bias (Karis 2013),
// tabulated.
#pragma once

#include "render/math/vector_math.h"

namespace polymorph {

/// Albedo f0 * scale + bias of a lobe whose reflectance at normal incidence is f0.
template <class V>
struct SplitAlbedoOf {
  V scale, bias;  ///< their sum is the albedo of a perfect reflector (single scattering)
};
using SplitAlbedo = SplitAlbedoOf<float>;

/// Nodes per axis. Node i stands for alpha or cosine (i / (kAlbedoNodes - 1))^2, so nodes are
/// denser near 0.
inline constexpr int kAlbedoNodes = 32;

/// Albedos per alpha and cosine (rows of equal alpha), and their cosine-weighted means per alpha.
struct AlbedoTables {
  SplitAlbedo directional[kAlbedoNodes * kAlbedoNodes];
  SplitAlbedo mean[kAlbedoNodes];
};
#if defined(__CUDACC__)
static __device__ AlbedoTables device_albedo_tables;  ///< copy of host_albedo_tables()
#endif
const AlbedoTables& host_albedo_tables();
PM_HD inline const AlbedoTables& albedo_tables() {
#if defined(__CUDA_ARCH__)
  return device_albedo_tables;
#else
  return host_albedo_tables();
#endif
}

/// A position between the nodes `index` and `index` + 1.
template <class V>
struct AlbedoCellOf {
  decltype(truncate(V{})) index;
  V fraction;
};
/// Finds the position of an alpha or cosine in [0, 1]; other values are clamped.
template <class V>
PM_HD AlbedoCellOf<V> find_albedo_cell(V value) {
  const V x = sqrt(clamp01(value)) * static_cast<float>(kAlbedoNodes - 1);
  const auto index = min(truncate(x), kAlbedoNodes - 2);
  return {index, x - to_float(index)};
}

/// Interpolates between the node at `index` and the next one.
template <class V, class I>
PM_HD SplitAlbedoOf<V> interpolate(const SplitAlbedo* nodes, I index, V fraction) {
  static_assert(sizeof(SplitAlbedo) == 2 * sizeof(float));
  const float* numbers = &nodes->scale;
  const I at = index * 2;
  return {lerp(gather(numbers, at), gather(numbers + 2, at), fraction),
          lerp(gather(numbers + 1, at), gather(numbers + 3, at), fraction)};
}

/// Interpolates along one axis in two rows of nodes: from the node at `index` to the next one.
template <class V>
struct AlbedoPairOf {
  SplitAlbedoOf<V> low, high;
};
PM_HD inline AlbedoPairOf<float> interpolate_rows(const SplitAlbedo* low, const SplitAlbedo* high,
                                                  std::int32_t index, float fraction) {
  return {interpolate(low, index, fraction), interpolate(high, index, fraction)};
}
#if defined(PM_PACKS)
inline AlbedoPairOf<Pack> interpolate_rows(const SplitAlbedo* low, const SplitAlbedo* high,
                                           PackMask index, Pack fraction) {
  Pack n[kLanes];
  gather_fours(&low->scale, &high->scale, index * 2, n);
  return {{lerp(n[0], n[2], fraction), lerp(n[1], n[3], fraction)},
          {lerp(n[4], n[6], fraction), lerp(n[5], n[7], fraction)}};
}
#endif

/// Looks up the albedo of a lobe for a direction of this cosine, interpolated bilinearly.
template <class V>
PM_HD SplitAlbedoOf<V> split_albedo(V alpha, V cosine) {
  const AlbedoCellOf<V> a = find_albedo_cell(alpha), c = find_albedo_cell(cosine);
  const SplitAlbedo* nodes = albedo_tables().directional;
  const auto index = a.index * kAlbedoNodes + c.index;
  const auto [low, high] = interpolate_rows(nodes, nodes + kAlbedoNodes, index, c.fraction);
  return {lerp(low.scale, high.scale, a.fraction), lerp(low.bias, high.bias, a.fraction)};
}
/// Looks up the cosine-weighted mean of the split albedo over all directions.
template <class V>
PM_HD SplitAlbedoOf<V> mean_split_albedo(V alpha) {
  const AlbedoCellOf<V> a = find_albedo_cell(alpha);
  return interpolate(albedo_tables().mean, a.index, a.fraction);
}

#if defined(PM_PACKS)
extern template SplitAlbedoOf<Pack> split_albedo(Pack, Pack);
extern template SplitAlbedoOf<Pack> mean_split_albedo(Pack);
#endif

}  // namespace polymorph
