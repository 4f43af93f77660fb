// Material lookup: the shading parameters of a mesh at a ray's hit.
#pragma once

#include "render/materials/materials.h"
#include "render/path/world.h"

namespace polymorph {

/// The mesh's own materials, mixed with what they turn into and with the common look, as one
/// material: for glass and for the AOVs.
Shading mixed_shading(const World& world, const MeshHit& hit);
ShadingOf<Pack3> mixed_shading(const World& world, const MeshHitOf<Pack>& hit);

/// How the surface scatters light at eight hits. The mesh's own materials and the common look are
/// two materials here, whose lobes are mixed. Where `matte`, gloss is left out.
BsdfOf<Pack3> bsdf_at(const World& world, const MeshHitOf<Pack>& hit, const Pack3& normal,
                      const Pack3& view, PackMask matte);

/// Of the light that arrives, glass lets this much straight through one boundary.
Vec3 glass_tint(const Shading& shading);

}  // namespace polymorph
