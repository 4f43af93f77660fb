// Registration: how much of a surface a map carries further from the other surface than the surface
// is thick. Formula: docs/method.md, Quality.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "kernels/mesh.h"

namespace polymorph {

/// Points of a surface that stand for equal shares of its area, and half its thickness at each:
/// half the way straight inward to the opposite wall. Points without an opposite wall are left out.
struct ThicknessSamples {
  std::vector<Vec3> points;
  std::vector<double> half_thickness;
};

/// Draws about `count` samples of a closed surface with outward normals. Deterministic.
ThicknessSamples sample_thickness(const Mesh& surface, std::size_t count = 4000);

/// Returns the share of the samples that were carried to places further from `other` than `scale`
/// times their half thickness, with `scale` the size of `other` in units of their own surface.
/// Nothing if there are no samples, or `other` is empty.
std::optional<double> share_off(const ThicknessSamples& samples, const std::vector<Vec3>& carried,
                                const Mesh& other, double scale);

}  // namespace polymorph
