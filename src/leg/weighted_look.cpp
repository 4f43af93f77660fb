#include "leg/weighted_look.h"

#include <algorithm>
#include <numeric>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// Returns the index of the object with the largest weight.
std::size_t find_heaviest(const Mixture& mixture) {
  const auto heaviest = std::max_element(
      mixture.objects.begin(), mixture.objects.end(),
      [](const MixedObject& a, const MixedObject& b) { return a.weight < b.weight; });
  return static_cast<std::size_t>(heaviest - mixture.objects.begin());
}

}  // namespace

std::vector<float> color_shares(std::span<const float> weights) {
  std::vector<float> shares;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    float other = 0;  // the largest weight of another object
    for (std::size_t j = 0; j < weights.size(); ++j)
      if (j != i) other = std::max(other, weights[j]);
    shares.push_back(weights[i] > 0 ? color_fade(weights[i] / (weights[i] + other)).color : 0);
  }
  const float sum = std::accumulate(shares.begin(), shares.end(), 0.0f);
  for (float& share : shares) share /= sum;
  return shares;
}

Result<PulledMixture> pull_mixture_back(const Mixture& mixture, const WeightedSurface& surface,
                                        Engine& engine) {
  PulledMixture pulled{mixture, /*places=*/{}, /*closest=*/{}};
  for (const MixedObject& object : mixture.objects) {
    PM_TRY(std::vector<Vec3> places,
           map_to_object(object, surface.lift, surface.mesh.positions, engine));
    pulled.places.push_back(std::move(places));
  }
  return pulled;
}

SurfaceLook weighted_look(const PulledMixture& pulled, std::span<const Triangle> triangles) {
  const Mixture& mixture = pulled.mixture;
  std::vector<float> weights;
  for (const MixedObject& object : mixture.objects) weights.push_back(object.weight);
  const std::vector<float> shares = color_shares(weights);
  const std::size_t heaviest = find_heaviest(mixture);
  SurfaceLook look;
  // Sums over the objects so far: of their shares, and of the weights of their detail. A layer with
  // the opacity share / share_sum leaves the shares of those below it in proportion.
  float share_sum = 0, detail = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    detail += color_fade(weights[i]).target;
    if (shares[i] <= 0) continue;
    share_sum += shares[i];
    Origins origins{pulled.places[i]};
    if (i == heaviest) origins.closest = pulled.closest;
    look.layers.push_back(object_layer(mixture.objects[i].object, triangles, origins,
                                       look.layers.empty() ? 1 : shares[i] / share_sum));
  }
  if (!mixture.settings.has_colors || detail >= 1) return look;
  look.color_opacity = 1 - detail;
  look.colors.resize(pulled.places.front().size());
  parallel_for(
      static_cast<std::int64_t>(look.colors.size()),
      [&](std::int64_t index) {
        const auto k = static_cast<std::size_t>(index);
        for (std::size_t i = 0; i < shares.size(); ++i)
          if (shares[i] > 0)
            look.colors[k] =
                look.colors[k] +
                plain_color(*mixture.objects[i].object, pulled.places[i][k]) * shares[i];
      },
      /*grain=*/4096);
  return look;
}

void blend_weighted_normals(PulledMixture& pulled, Mesh& surface) {
  const std::size_t heaviest = find_heaviest(pulled.mixture);
  const MixedObject& mixed = pulled.mixture.objects[heaviest];
  const float weight = end_normals_weight(1 - mixed.weight);
  if (weight == 0 || surface.normals.empty()) return;
  AffineMap map;
  for (int i = 0; i < 3; ++i)
    map.rows[i] = to_float({mixed.linear.at(i, 0), mixed.linear.at(i, 1), mixed.linear.at(i, 2)});
  pulled.closest =
      add_end_normals({*mixed.object, map, pulled.places[heaviest], weight}, surface.normals);
}

std::vector<std::uint32_t> weighted_labels(const PulledMixture& pulled) {
  const std::size_t heaviest = find_heaviest(pulled.mixture);
  return nearest_labels(*pulled.mixture.objects[heaviest].object, pulled.places[heaviest]);
}

}  // namespace polymorph
