// Error measurement of a carried mesh: distances to the surface and inverted triangles.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh/carry/carry.h"
#include "mesh/carry/deviation.h"

namespace polymorph {

/// Error of a mesh against a surface, and where it arises.
struct CarryMeasure {
  CarryFault fault;
  /// Number of inverted triangles, plus the sum over all triangles of max(d / limit - 0.9, 0)^2, d
  /// from triangle_distance.
  float badness = 0;
  std::vector<float> triangle_distance;   ///< per triangle: maximum to and from the surface
  std::vector<std::uint32_t> inverted;    ///< indices of triangles
  std::vector<Deviation::Listed> misses;  ///< surface points beyond half a limit from the mesh
  std::vector<std::uint32_t> near;        ///< nearest triangle of the surface, per mesh point
  std::vector<std::uint32_t> mesh_near;   ///< nearest triangle of the mesh, per surface point
};

/// Lists what each triangle adds to the badness of a mesh. `limit`: as in CarryMeter.
std::vector<float> list_badness(const CarryMeasure& measure, float limit);

/// Lists the triangles that face against the surface's normal at the point closest to their
/// centroids. `near`: per point, a guess of the surface's nearest triangle.
std::vector<std::uint32_t> find_inverted(std::span<const Vec3> points,
                                         std::span<const Triangle> triangles,
                                         const CarryTarget& target,
                                         std::span<const std::uint32_t> near);

/// Measures similar meshes against one surface; only triangles that changed since the last call are
/// measured again.
class CarryMeter {
 public:
  /// Distances below 0.8 `limit` are only bounded, which is faster (Deviation).
  CarryMeter(const CarryTarget& target, float limit) : target_(target), limit_(limit) {}
  /// `near`: per point, a guess of the surface's nearest triangle; may be empty.
  CarryMeasure measure(std::span<const Vec3> points, std::span<const Triangle> triangles,
                       std::span<const std::uint32_t> near = {});

 private:
  using Key = std::array<float, 9>;  ///< a triangle's corners
  struct KeyHash {
    std::size_t operator()(const Key& key) const;
  };
  /// Index of each triangle in the last mesh, or KnownDeviation::kNew.
  std::vector<std::uint32_t> find_in_last_mesh(std::span<const Key> keys) const;

  const CarryTarget& target_;
  float limit_;
  std::vector<Key> last_keys_;                  ///< corners per triangle of the last mesh
  std::vector<std::uint8_t> last_is_inverted_;  ///< per triangle of the last mesh
  std::optional<Deviation> mesh_to_surface_, surface_to_mesh_;
};

}  // namespace polymorph
