// Registration error: the fraction of a surface that a map moves further from the other surface
// than half the surface's thickness. Formula: docs/method.md, Quality.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "kernels/mesh.h"

namespace polymorph {

/// Points of a surface that represent equal areas, and half the thickness at each point: half the
/// distance straight inward to the opposite wall. Points without an opposite wall are left out.
struct ThicknessSamples {
  std::vector<Vec3> points;
  std::vector<double> half_thickness;
};

/// Draws about `count` samples of a closed surface with outward normals. Deterministic.
ThicknessSamples sample_thickness(const Mesh& surface, std::size_t count = 4000);

/// Returns the fraction of the samples that a map moves further from the surface `other` than
/// `scale` times their half thickness. `moved` has their positions after the map; `scale` is the
/// size of `other` over the size of the samples' surface. Returns nullopt if there are no samples,
/// or `other` is empty.
std::optional<double> missed_fraction(const ThicknessSamples& samples,
                                      const std::vector<Vec3>& moved, const Mesh& other,
                                      double scale);

}  // namespace polymorph
