#include "model/repair/shell.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "base/parallel.h"

namespace polymorph {

double undecided_share(const Model& model, const InsideTest& inside) {
  constexpr std::int64_t kPoints = 4096;
  constexpr double kAround = 0.25, kDecided = 0.75;
  // The R3 sequence (Roberts 2018).
  constexpr double kStep[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
  const Box box = model.box();
  std::vector<double> winding(kPoints);
  parallel_for(
      kPoints,
      [&](std::int64_t i) {
        const auto part = [&](int axis) {
          const double x = 0.5 + kStep[axis] * static_cast<double>(i + 1);
          return static_cast<float>(x - std::floor(x));
        };
        const Vec3 p = box.low + box.size() * Vec3{part(0), part(1), part(2)};
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
