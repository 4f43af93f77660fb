// Surface measures: volume, area, bending energy, Hausdorff distance, hidden parts.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "base/box.h"
#include "kernels/mesh.h"
#include "model/model.h"

namespace polymorph {

/// Integral of the squared mean curvature over the surface, from the vertex normals: 4 pi for any
/// sphere. A mesh without normals (a flat one) is measured by those of its triangles around each
/// vertex.
double bending_energy(const Mesh& mesh);

/// Points spread over a surface, and the way to its closest points.
class MeasuredSurface {
 public:
  /// Copies what it needs.
  MeasuredSurface(std::span<const Vec3> points, std::span<const Triangle> triangles);
  explicit MeasuredSurface(const Mesh& mesh) : MeasuredSurface(mesh.positions, mesh.triangles) {}
  ~MeasuredSurface();
  MeasuredSurface(MeasuredSurface&&) noexcept;
  MeasuredSurface& operator=(MeasuredSurface&&) noexcept;
  bool empty() const;

  struct Distance {
    double mean = 0;     ///< of both directions' means: the chamfer distance
    double largest = 0;  ///< Hausdorff's, over the samples of both
  };
  /// Some 4000 samples per side, evenly spread, and their exact closest points. Infinite if just
  /// one of the two is empty. Samples of this one that lie deeper than `hidden` inside the other
  /// one, which is then closed and outward, do not count: a spout goes on inside its pot.
  Distance distance_to(const MeasuredSurface& other,
                       double hidden = std::numeric_limits<double>::infinity()) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The convex hull of some points, from outside: the half spaces of 512 directions, each moved out
/// by `margin`.
class DilatedHull {
 public:
  DilatedHull(std::span<const Vec3> points, double margin);
  bool contains(Vec3 point) const;
  /// Volume of the closed surface's inside that lies outside, on a grid of some 50 000 points; 0
  /// exactly if no vertex is outside.
  double leakage(const Mesh& mesh) const;

 private:
  std::vector<Vec3> directions_;
  std::vector<float> limits_;
};

}  // namespace polymorph
