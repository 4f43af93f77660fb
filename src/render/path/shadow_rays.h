// Shadow rays from surfaces to lights, traced sixteen at a time.
#pragma once

#include <array>

#include "render/path/world.h"

namespace polymorph {

/// The share of light that comes along a ray past all meshes: none past anything opaque; straight
/// through glass.
Vec3 through_meshes(const World& world, const Ray& ray, RayStats& stats);

/// Collects rays towards lights; what arrives is added to `direct`, in the order of adding.
class ShadowRays {
 public:
  ShadowRays(const World& world, RayStats& stats, Vec3* direct)
      : world_(world), stats_(stats), direct_(direct) {}

  /// Light that arrives along the rays unless something is in their way: what the floor hides and
  /// what is black anyway is left out. direct[path[l]] gets the share of lane l, where `wanted`.
  void add(const RayOf<Pack3>& ray, const Pack3& light, PackBits path, PackMask wanted);
  void flush();

 private:
  struct Row {
    Ray ray;
    Vec3 light;
    std::uint32_t path;
    float rest[4];
  };
  void look(int first, int count);

  const World& world_;
  RayStats& stats_;
  Vec3* direct_;
  int count_ = 0;
  std::array<Row, 2 * kPacket> rows_;
};

}  // namespace polymorph
