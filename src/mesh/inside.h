// Inside test: generalized winding number (Jacobson et al. 2013) or ray parity.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mesh/mesh_view.h"

namespace polymorph {

enum class InsideRule : std::uint8_t {
  /// Generalized winding number >= 0.5 (Jacobson et al. 2013); tolerates holes and doubled faces.
  kWinding,
  /// Odd number of crossings along one ray (Gilbert 2010, 5.1.2.1). Exact for closed models; where
  /// components overlap, their overlap counts as outside. The ray is fixed, oblique to axes and
  /// diagonals, and counts a crossing at an edge or corner once.
  kParity,
};

/// Inside test by a hierarchy over a copy of the triangles; the model may be destroyed before it.
/// Const member functions may be called from many threads at once.
class InsideTest {
 public:
  explicit InsideTest(MeshView mesh, InsideRule rule = InsideRule::kWinding);
  ~InsideTest();
  InsideTest(InsideTest&&) noexcept;
  InsideTest& operator=(InsideTest&&) noexcept;

  bool inside(Vec3 point) const;
  /// Generalized winding number: 1 inside a closed model, 0 outside. A group of triangles farther
  /// than twice its radius is approximated by the first two terms of a Taylor series (Barill et al.
  /// 2018). The result is within 0.08 of the exact sum on all models measured.
  double winding_number(Vec3 point) const;
  /// Sets numbers[i] to winding_number(points[i]); faster than single calls if consecutive points
  /// are near each other.
  void winding_numbers(std::span<const Vec3> points, std::span<double> numbers) const;
  /// Tests many points in parallel; one byte per point (1 = inside).
  std::vector<std::uint8_t> inside(std::span<const Vec3> points) const;
  /// Tests many points in the calling thread; sets one byte per point (1 = inside).
  void inside(std::span<const Vec3> points, std::span<std::uint8_t> are_inside) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
  InsideRule rule_ = InsideRule::kWinding;
};

}  // namespace polymorph
