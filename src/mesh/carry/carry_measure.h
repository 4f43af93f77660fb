// How well a carried mesh stands for the surface of a moment: distances and inverted triangles.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "mesh/carry/carry.h"
#include "mesh/carry/deviation.h"

namespace polymorph {

struct CarryMeasure {
  CarryFault fault;
  std::vector<float> of_triangle;         ///< how far each triangle is off, or the surface near it
  std::vector<std::uint32_t> inverted;    ///< triangles
  std::vector<Deviation::Listed> misses;  ///< of the surface, what the mesh is not near to
  std::vector<std::uint32_t> near;        ///< of each point: nearest triangle of the surface
  std::vector<std::uint32_t> mesh_near;   ///< of each point of the surface: of the mesh
};

bool is_better(const CarryFault& a, const CarryFault& b);

/// Measures meshes that differ little against one surface, and what differs alone.
class CarryMeter {
 public:
  /// Distances below a share of `limit` are not told apart.
  CarryMeter(const CarryTarget& target, float limit) : target_(target), limit_(limit) {}
  CarryMeasure measure(std::span<const Vec3> points, std::span<const Triangle> triangles);

 private:
  using Key = std::array<float, 9>;  ///< a triangle's corners
  struct KeyHash {
    std::size_t operator()(const Key& key) const;
  };
  /// The numbers of triangles in the last mesh, or kNew.
  std::vector<std::uint32_t> numbers_before(std::span<const Key> keys) const;

  const CarryTarget& target_;
  float limit_;
  std::unordered_map<Key, std::uint32_t, KeyHash> last_;
  std::optional<Deviation> out_, in_;
};

}  // namespace polymorph
