// Shadow rays from surfaces to lights, traced sixteen at a time.
#pragma once

#include <array>

#include "render/path/world.h"

namespace polymorph {

/// Fraction of light that passes all meshes along a ray: 0 past anything opaque; glass does not
/// bend it.
Vec3 trace_transmittance(const World& world, const Ray& ray, RayStats& stats);

/// Collects rays towards lights and adds the unoccluded light to `direct`, in the order of adding.
class ShadowRays {
 public:
  ShadowRays(const World& world, RayStats& stats, Vec3* direct)
      : world_(world), stats_(stats), direct_(direct) {}

  /// Adds rays and the light that arrives along them if nothing occludes them. Rays that the floor
  /// occludes or that carry no light are omitted. direct[path[l]] receives the light of lane l, for
  /// the lanes `lanes`.
  void add(const RayOf<Pack3>& ray, const Pack3& light, PackBits path, PackMask lanes);
  void flush();

 private:
  struct Row {
    Ray ray;
    Vec3 light;
    std::uint32_t path;
    float padding[4];
  };
  void trace(int first, int count);

  const World& world_;
  RayStats& stats_;
  Vec3* direct_;
  int count_ = 0;
  std::array<Row, 2 * kPacket> rows_;
};

}  // namespace polymorph
