// Distances and maps that tests of surfaces between two objects share.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "kernels/distance_field.h"
#include "kernels/engine.h"
#include "kernels/regression.h"

namespace polymorph {

/// Returns the distances `distance(p)`, positive inside, on `points`^3 points over [-2, 2]^3.
template <class Function>
std::shared_ptr<const DistanceGrid> distances_of(int points, const Function& distance) {
  auto out = std::make_shared<DistanceGrid>();
  out->grid = {{-2, -2, -2}, 4.0f / static_cast<float>(points - 1), {points, points, points}};
  for (int z = 0; z < points; ++z)
    for (int y = 0; y < points; ++y)
      for (int x = 0; x < points; ++x)
        out->values.push_back(distance(grid_point(out->grid, {x, y, z})));
  out->lipschitz = 1.8f;  // at least sqrt(3), for trilinear interpolation
  return out;
}
inline std::shared_ptr<const DistanceGrid> sphere_distances(float radius, Vec3 center = {}) {
  return distances_of(65, [=](Vec3 p) { return radius - length(p - center); });
}
inline std::shared_ptr<const DistanceGrid> torus_distances(float large, float small) {
  return distances_of(81, [=](Vec3 p) {
    const float ring = std::sqrt(p.x * p.x + p.z * p.z) - large;
    return small - std::sqrt(ring * ring + p.y * p.y);
  });
}

/// Returns a lattice over [-2, 2]^3 and two nodes more on each side.
inline Grid test_lattice(float spacing = 0.25f) {
  const int nodes = static_cast<int>(std::ceil(4.0f / spacing)) + 5;
  const float low = -2 - 2 * spacing;
  return {{low, low, low}, spacing, {nodes, nodes, nodes}};
}

/// Returns two maps of `count` random samples, up to `stir` away from the identity in each
/// coordinate; with slopes, if `sloped`. The progress is 0.2 to 0.8, the level's weight 0.4 to 1.
inline std::shared_ptr<const Regression> random_map(int count, float stir, unsigned seed,
                                                    bool sloped = false) {
  std::mt19937 random(seed);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-23f - 1; };
  auto map = std::make_shared<Regression>();
  map->maps = 2;
  map->lattice = test_lattice();
  map->sloped = sloped;
  for (int i = 0; i < count; ++i) {
    map->samples.push_back({{unit(), unit(), unit()}, 1.5f + unit(), 0.3f + 0.1f * unit()});
    for (int m = 0; m < 2; ++m) {
      BallAttribute attribute;
      for (int k = 0; k < 3; ++k) {
        attribute.value[k] = stir * unit();
        if (sloped) attribute.slope[k] = {stir * unit(), stir * unit(), stir * unit()};
      }
      attribute.value[3] = m == 0 ? 0.5f + 0.3f * unit() : 0.7f + 0.3f * unit();
      map->values.push_back(attribute);
    }
  }
  return map;
}

/// Returns the map with `count` random landmarks, whose goals are up to `stir` away from them in
/// each coordinate.
inline std::shared_ptr<const Regression> map_with_landmarks(const Regression& map, int count,
                                                            float stir, unsigned seed) {
  std::mt19937 random(seed);
  const auto unit = [&random] { return static_cast<float>(random() >> 8) * 0x1p-23f - 1; };
  const auto offset = [&] { return Vec3{unit(), unit(), unit()}; };
  auto out = std::make_shared<Regression>(map);
  for (int i = 0; i < count; ++i) {
    RegressionLandmark landmark;
    landmark.position = offset();
    landmark.deviation = 0.3f;
    for (Vec3& goal : landmark.goal) goal = landmark.position + stir * offset();
    out->landmarks.push_back(landmark);
  }
  return out;
}

/// Returns two identity maps, with this progress and the level's weight 1 everywhere.
inline std::shared_ptr<const Regression> identity_map(float progress) {
  auto map = std::make_shared<Regression>();
  map->maps = 2;
  map->lattice = test_lattice();
  map->samples = {{{0, 0, 0}, 1, 1}};
  map->values.resize(2);
  map->values[0].value[3] = progress;
  map->values[1].value[3] = 1;
  return map;
}

}  // namespace polymorph
