#include "render/gloss_table.h"

#include <array>

#include "render/ggx.h"
#include "render/sampler.h"

namespace polymorph {
namespace {

constexpr int kNodes = 32;  // an axis; alpha and cosine both run over square roots, denser near 0

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
    const float alpha = std::max(node_value(a), kLeastAlpha);
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

struct Cell {
  int index;
  float fraction;
};
Cell cell_of(float value) {
  const float x = std::sqrt(clamp01(value)) * (kNodes - 1);
  const int index = std::min(static_cast<int>(x), kNodes - 2);
  return {index, x - static_cast<float>(index)};
}
SplitAlbedo mix(SplitAlbedo a, SplitAlbedo b, float t) {
  return {lerp(a.scale, b.scale, t), lerp(a.bias, b.bias, t)};
}

}  // namespace

SplitAlbedo split_albedo(float alpha, float cosine) {
  const Cell a = cell_of(alpha), c = cell_of(cosine);
  const SplitAlbedo* node = &tables().directional[a.index * kNodes + c.index];
  return mix(mix(node[0], node[1], c.fraction), mix(node[kNodes], node[kNodes + 1], c.fraction),
             a.fraction);
}

SplitAlbedo mean_split_albedo(float alpha) {
  const Cell a = cell_of(alpha);
  return mix(tables().mean[a.index], tables().mean[a.index + 1], a.fraction);
}

}  // namespace polymorph
