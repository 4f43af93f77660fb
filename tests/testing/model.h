// Helpers of the model and spheres tests: small solids.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.h"
#include "testing/temporary_folder.h"

namespace polymorph {

/// Adds the box [low, high] as 12 triangles that face outward or, if `inverted`, inward.
inline void add_box(Model& model, Vec3 low, Vec3 high, bool inverted = false) {
  const auto base = static_cast<std::uint32_t>(model.points.size());
  for (int i = 0; i < 8; ++i)
    model.points.push_back(
        {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  static constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& s : kSides)
    for (const auto& t : {std::array{s[0], s[1], s[2]}, std::array{s[0], s[2], s[3]}})
      model.triangles.push_back(inverted ? Triangle{{base + t[0], base + t[2], base + t[1]}}
                                         : Triangle{{base + t[0], base + t[1], base + t[2]}});
}

inline Model box_model(Vec3 low, Vec3 high) {
  Model model;
  model.name = "box";
  add_box(model, low, high);
  return model;
}

/// Returns the surface of revolution of a profile of points (radius, height) around the y axis. It
/// is closed if the first and the last point lie on the axis.
inline Model lathe(const std::vector<Vec2>& profile) {
  constexpr int kSteps = 64;
  Model model;
  model.name = "lathe";
  for (const Vec2 p : profile)
    for (int i = 0; i < kSteps; ++i) {
      const double u = 2 * M_PI * i / kSteps;
      model.points.push_back(
          {p.x * static_cast<float>(std::cos(u)), p.y, -p.x * static_cast<float>(std::sin(u))});
    }
  const auto at = [&](std::size_t k, int i) {
    return static_cast<std::uint32_t>(k) * kSteps +
           (profile[k].x > 0 ? static_cast<std::uint32_t>(i % kSteps) : 0);
  };
  for (std::size_t k = 0; k + 1 < profile.size(); ++k)
    for (int i = 0; i < kSteps; ++i) {
      if (profile[k].x > 0) model.triangles.push_back({{at(k, i), at(k, i + 1), at(k + 1, i + 1)}});
      if (profile[k + 1].x > 0)
        model.triangles.push_back({{at(k, i), at(k + 1, i + 1), at(k + 1, i)}});
    }
  return model;
}

/// The unit cube [0, 1]^3 as OBJ text: outward quads without normals.
inline constexpr const char* kCubeObj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
    "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

inline bool any_contains(const std::vector<std::string>& lines, std::string_view text) {
  for (const std::string& line : lines)
    if (line.find(text) != std::string::npos) return true;
  return false;
}

}  // namespace polymorph
