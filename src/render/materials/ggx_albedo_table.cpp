#include "render/materials/ggx_albedo_table.h"

#include <algorithm>

#include "render/materials/ggx.h"
#include "render/math/sampler.h"

namespace polymorph {
namespace {

/// Returns the alpha or cosine of node i.
float node_value(int i) { return square(static_cast<float>(i) / (kAlbedoNodes - 1)); }

/// Integrates the albedo with 256 samples of a Hammersley sequence.
SplitAlbedo integrate(float alpha, float cosine) {
  constexpr int kSamples = 256;
  const Vec3 view{std::sqrt(std::max(0.0f, 1 - cosine * cosine)), 0, cosine};
  double scale = 0, bias = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const float u = (static_cast<float>(i) + 0.5f) / kSamples;
    const float v = static_cast<float>(reverse_bits(i) >> 8) * 0x1p-24f + 0.5f / kSamples;
    const Vec3 half = sample_ggx_normal(view, alpha, u, v);
    const float facing = dot(view, half);
    const float reflected_z = 2 * facing * half.z - view.z;
    if (reflected_z <= 0) continue;
    // BSDF times cosine divided by the pdf, without the Fresnel term: G2 / G1.
    const float weight = ggx_visibility(cosine, reflected_z, alpha) * 4 * cosine * reflected_z /
                         ggx_masking(cosine, alpha);
    const float fresnel = schlick(facing);
    scale += weight * (1 - fresnel);
    bias += weight * fresnel;
  }
  return {static_cast<float>(scale / kSamples), static_cast<float>(bias / kSamples)};
}

AlbedoTables make_tables() {
  AlbedoTables tables;
  for (int a = 0; a < kAlbedoNodes; ++a) {
    const float alpha = std::max(node_value(a), kMinAlpha);
    for (int c = 0; c < kAlbedoNodes; ++c)  // at a cosine of 0 the weight would be 0 / 0
      tables.directional[a * kAlbedoNodes + c] = integrate(alpha, std::max(node_value(c), 1e-3f));
    // The mean 2 int E(c) c dc with c = s^2 is 4 int E s^3 ds. The trapezoidal sums over s are
    // divided by the sum of s^3, so the mean of a constant albedo is exact.
    double scale = 0, bias = 0, sum = 0;
    for (int c = 0; c < kAlbedoNodes; ++c) {
      const double s = static_cast<double>(c) / (kAlbedoNodes - 1);
      const double weight = s * s * s * (c == kAlbedoNodes - 1 ? 0.5 : 1.0);
      scale += weight * tables.directional[a * kAlbedoNodes + c].scale;
      bias += weight * tables.directional[a * kAlbedoNodes + c].bias;
      sum += weight;
    }
    tables.mean[a] = {static_cast<float>(scale / sum), static_cast<float>(bias / sum)};
  }
  return tables;
}

}  // namespace

const AlbedoTables& host_albedo_tables() {
  static const AlbedoTables kTables = make_tables();
  return kTables;
}

template SplitAlbedoOf<Pack> split_albedo(Pack, Pack);
template SplitAlbedoOf<Pack> mean_split_albedo(Pack);

}  // namespace polymorph
