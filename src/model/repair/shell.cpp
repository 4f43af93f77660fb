#include "model/repair/shell.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "base/random.h"

namespace polymorph {

double measure_undecided_fraction(const Model& model, const InsideTest& inside) {
  constexpr std::int64_t kPoints = 4096;
  constexpr double kMinMagnitude = 0.25, kDecided = 0.75;
  const Box box = model.box();
  std::vector<double> winding(kPoints);
  parallel_for(
      kPoints,
      [&](std::int64_t i) {
        const auto [x, y, z] = r3_point(static_cast<std::size_t>(i));
        const Vec3 fraction{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
        const Vec3 p = box.low + box.size() * fraction;
        winding[static_cast<std::size_t>(i)] = inside.winding_number(p);
      },
      /*grain=*/64);
  int surrounded = 0, undecided = 0;  // numbers of points
  for (const double w : winding) {
    surrounded += std::fabs(w) > kMinMagnitude;
    undecided += std::fabs(w) > kMinMagnitude && w < kDecided;
  }
  return surrounded > 0 ? static_cast<double>(undecided) / surrounded : 1;
}

}  // namespace polymorph
