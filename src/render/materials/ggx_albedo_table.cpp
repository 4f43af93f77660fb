#include "render/materials/ggx_albedo_table.h"

#include <algorithm>
#include <array>

#include "render/materials/ggx.h"
#include "render/math/sampler.h"

namespace polymorph {
namespace {

constexpr int kNodes = 32;  // per axis; alpha and cosine are spaced by square roots, denser near 0

struct Tables {
  std::array<SplitAlbedo, kNodes * kNodes> directional;
  std::array<SplitAlbedo, kNodes> mean;
};

float node_value(int i) { return square(static_cast<float>(i) / (kNodes - 1)); }

SplitAlbedo integrate(float alpha, float cosine) {
  constexpr int kSamples = 256;
  const Vec3 view{std::sqrt(std::max(0.0f, 1 - cosine * cosine)), 0, cosine};
  double scale = 0, bias = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const float u = (static_cast<float>(i) + 0.5f) / kSamples;
    const float v = static_cast<float>(reverse_bits(i) >> 8) * 0x1p-24f + 0.5f / kSamples;
    const Vec3 half = sample_ggx_normal(view, alpha, u, v);
    const float facing = dot(view, half);
    const float height = 2 * facing * half.z - view.z;
    if (height <= 0) continue;
    const float weight =
        ggx_visibility(cosine, height, alpha) * 4 * cosine * height / ggx_masking(cosine, alpha);
    const float fresnel = schlick(facing);
    scale += weight * (1 - fresnel);
    bias += weight * fresnel;
  }
  return {static_cast<float>(scale / kSamples), static_cast<float>(bias / kSamples)};
}

Tables make_tables() {
  Tables tables;
  for (int a = 0; a < kNodes; ++a) {
    const float alpha = std::max(node_value(a), kMinAlpha);
    for (int c = 0; c < kNodes; ++c)
      tables.directional[a * kNodes + c] = integrate(alpha, std::max(node_value(c), 1e-3f));
    // 2 int E(c) c dc with c = s^2: 4 int E s^3 ds, trapezoids over s normalised by those of s^3.
    double scale = 0, bias = 0, sum = 0;
    for (int c = 0; c < kNodes; ++c) {
      const double s = static_cast<double>(c) / (kNodes - 1);
      const double weight = s * s * s * (c == kNodes - 1 ? 0.5 : 1.0);
      scale += weight * tables.directional[a * kNodes + c].scale;
      bias += weight * tables.directional[a * kNodes + c].bias;
      sum += weight;
    }
    tables.mean[a] = {static_cast<float>(scale / sum), static_cast<float>(bias / sum)};
  }
  return tables;
}

const Tables& tables() {
  static const Tables kTables = make_tables();
  return kTables;
}

/// A position between two nodes.
template <class V>
struct CellOf {
  decltype(truncate(V{})) index;
  V fraction;
};
template <class V>
CellOf<V> find_cell(V value) {
  const V x = sqrt(clamp01(value)) * static_cast<float>(kNodes - 1);
  const auto index = min(truncate(x), kNodes - 2);
  return {index, x - to_float(index)};
}

/// Interpolates between the node at `index` and the next one.
template <class V, class I>
SplitAlbedoOf<V> interpolate(const SplitAlbedo* nodes, I index, V fraction) {
  static_assert(sizeof(SplitAlbedo) == 2 * sizeof(float));
  const float* numbers = &nodes->scale;
  const I at = index * 2;
  return {lerp(gather(numbers, at), gather(numbers + 2, at), fraction),
          lerp(gather(numbers + 1, at), gather(numbers + 3, at), fraction)};
}

template <class V>
SplitAlbedoOf<V> look_up(V alpha, V cosine) {
  const CellOf<V> a = find_cell(alpha), c = find_cell(cosine);
  const SplitAlbedo* nodes = tables().directional.data();
  const auto index = a.index * kNodes + c.index;
  const SplitAlbedoOf<V> low = interpolate(nodes, index, c.fraction);
  const SplitAlbedoOf<V> high = interpolate(nodes + kNodes, index, c.fraction);
  return {lerp(low.scale, high.scale, a.fraction), lerp(low.bias, high.bias, a.fraction)};
}
template <class V>
SplitAlbedoOf<V> look_up_mean(V alpha) {
  const CellOf<V> a = find_cell(alpha);
  return interpolate(tables().mean.data(), a.index, a.fraction);
}

}  // namespace

SplitAlbedoOf<float> split_albedo(float alpha, float cosine) { return look_up(alpha, cosine); }
SplitAlbedoOf<Pack> split_albedo(Pack alpha, Pack cosine) { return look_up(alpha, cosine); }
SplitAlbedoOf<float> mean_split_albedo(float alpha) { return look_up_mean(alpha); }
SplitAlbedoOf<Pack> mean_split_albedo(Pack alpha) { return look_up_mean(alpha); }

}  // namespace polymorph
