// Surface measures: bending energy, chamfer and Hausdorff distance, volume outside a hull.
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "kernels/mesh.h"

namespace polymorph {

/// Returns the integral of the squared mean curvature over the surface: 4 pi for any sphere. The
/// curvature is the divergence of the vertex normals; a mesh without normals gets the averages of
/// its face normals around each vertex.
double bending_energy(const Mesh& mesh);

/// A surface with samples spread evenly over it and a query for its closest points.
class MeasuredSurface {
 public:
  /// Copies the points and triangles that it needs.
  MeasuredSurface(std::span<const Vec3> points, std::span<const Triangle> triangles);
  explicit MeasuredSurface(const Mesh& mesh) : MeasuredSurface(mesh.positions, mesh.triangles) {}
  ~MeasuredSurface();
  MeasuredSurface(MeasuredSurface&&) noexcept;
  MeasuredSurface& operator=(MeasuredSurface&&) noexcept;
  bool empty() const;

  struct Distance {
    double mean = 0;     ///< chamfer distance: mean of both directions' mean distances
    double largest = 0;  ///< Hausdorff distance over the samples of both surfaces
  };
  /// Measures the distances between about 4000 samples of each surface and their exact closest
  /// points on the other one. The distances are infinite if just one of the two is empty. Samples
  /// of this surface that lie deeper than `hidden_depth` inside `other` are left out, because they
  /// are not visible (a spout continues inside its pot); `other` must then be closed, with normals
  /// outward.
  Distance distance_to(const MeasuredSurface& other,
                       double hidden_depth = std::numeric_limits<double>::infinity()) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

/// Outer approximation of the convex hull of some points: the intersection of half spaces in 512
/// directions, each moved outward by `margin`.
class DilatedHull {
 public:
  DilatedHull(std::span<const Vec3> points, double margin);
  bool contains(Vec3 point) const;
  /// Returns the part of the volume inside `mesh`, a closed surface, that lies outside this hull.
  /// It is measured on a grid of about 50 000 points over the mesh's box, and exactly 0 if no
  /// vertex lies outside.
  double leakage(const Mesh& mesh) const;

 private:
  std::vector<Vec3> directions_;  ///< unit vectors
  std::vector<float> limits_;  ///< dot(p, directions_[k]) is at most limits_[k] for p in the hull
};

}  // namespace polymorph
