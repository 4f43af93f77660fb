#include "model/repair/face_sides.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/parallel.h"

namespace polymorph {

std::vector<FaceSide> classify_faces(const Model& model, const InsideTest& inside, float step) {
  std::vector<FaceSide> sides(model.triangles.size(), FaceSide::kMixed);
  parallel_for(
      static_cast<std::int64_t>(sides.size()),
      [&](std::int64_t index) {
        const auto t = static_cast<std::size_t>(index);
        const Vec3 a = model.points[model.triangles[t].v[0]],
                   b = model.points[model.triangles[t].v[1]],
                   c = model.points[model.triangles[t].v[2]];
        const Vec3 normal = normalized(cross(b - a, c - a));
        int boundary = 0, sheet = 0, hidden = 0;
        constexpr std::array<Vec3, 4> kWeights{
            {{1.f / 3, 1.f / 3, 1.f / 3}, {.8f, .1f, .1f}, {.1f, .8f, .1f}, {.1f, .1f, .8f}}};
        for (const Vec3 w : kWeights) {
          const Vec3 p = a * w.x + b * w.y + c * w.z;
          const double front = inside.winding_number(p + normal * step),
                       back = inside.winding_number(p - normal * step);
          const double high = std::max(front, back), low = std::min(front, back);
          sheet += high < kDecidedWinding;
          boundary += high >= kDecidedWinding && low < 0.5;
          hidden += low >= kDecidedWinding;
        }
        if (boundary == 4) sides[t] = FaceSide::kBoundary;
        if (sheet == 4) sides[t] = FaceSide::kSheet;
        if (hidden == 4) sides[t] = FaceSide::kHidden;
      },
      64);
  return sides;
}

std::vector<std::uint32_t> list_outer_faces(const std::vector<FaceSide>& sides) {
  std::vector<std::uint32_t> faces;
  for (std::size_t t = 0; t < sides.size(); ++t)
    if (sides[t] != FaceSide::kHidden) faces.push_back(static_cast<std::uint32_t>(t));
  if (faces.empty()) {
    faces.resize(sides.size());
    std::iota(faces.begin(), faces.end(), 0u);
  }
  return faces;
}

}  // namespace polymorph
