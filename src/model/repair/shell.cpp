#include "model/repair/shell.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "base/random.h"

namespace polymorph {

double undecided_share(const Model& model, const InsideTest& inside) {
  constexpr std::int64_t kPoints = 4096;
  constexpr double kAround = 0.25, kDecided = 0.75;
  const Box box = model.box();
  std::vector<double> winding(kPoints);
  parallel_for(
      kPoints,
      [&](std::int64_t i) {
        const auto [x, y, z] = r3_point(static_cast<std::size_t>(i));
        const Vec3 part{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
        const Vec3 p = box.low + box.size() * part;
        winding[static_cast<std::size_t>(i)] = inside.winding_number(p);
      },
      64);
  int around = 0, undecided = 0;
  for (const double w : winding) {
    around += std::fabs(w) > kAround;
    undecided += std::fabs(w) > kAround && w < kDecided;
  }
  return around > 0 ? static_cast<double>(undecided) / around : 1;
}

}  // namespace polymorph
