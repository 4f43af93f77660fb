#include "field/hollow_distances.h"

#include <algorithm>
#include <cstddef>

#include "field/distance_grid.h"

namespace polymorph {

DistanceGrid hollow_distances(DistanceGrid walls, const DistanceGrid& filled) {
  float depth = 0;  // the largest distance to a wall in the cavity
  for (std::size_t i = 0; i < walls.values.size(); ++i)
    if (filled.values[i] > 0) depth = std::max(depth, -walls.values[i]);
  // At a distance r from the wall, let w be the new value and d = r the other object's distance.
  // The mix (1 - q) w + q d is 0 if w = -r q / (1 - q): the wall has grown by r when the other
  // object's weight is q. With q = kRate (r / depth)^2, walls grow fast at first, before the other
  // object's distances can tear them. Outside the filled vessel its distance is added, so that the
  // values are continuous at an opening.
  constexpr float kRate = 0.95f;
  for (std::size_t i = 0; i < walls.values.size(); ++i) {
    float& value = walls.values[i];
    if (value >= 0) continue;
    const float r = -value, x = std::min(r / depth, 1.0f), q = kRate * x * x;
    value = std::max(value, std::min(filled.values[i], 0.0f) - r * q / (1 - q));
  }
  set_lipschitz(walls);
  return walls;
}

}  // namespace polymorph
