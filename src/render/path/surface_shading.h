// Material lookup: the shading parameters of a mesh at a ray's hit.
#pragma once

#include "render/materials/materials.h"
#include "render/path/world.h"

namespace polymorph {

/// The mesh's own materials, mixed with its other layers and with the common look, as one material:
/// for glass and for the AOVs.
Shading mixed_shading(const World& world, const MeshHit& hit);
ShadingOf<Pack3> mixed_shading(const World& world, const MeshHitOf<Pack>& hit);

/// Makes the BSDF at eight hits. The mesh's own materials and the common look are two materials
/// here, whose lobes are mixed. Gloss is omitted where `matte`.
BsdfOf<Pack3> make_bsdf_at(const World& world, const MeshHitOf<Pack>& hit, const Pack3& normal,
                           const Pack3& view, PackMask matte);

/// Fraction of light that glass transmits at one boundary, without Fresnel reflection.
Vec3 glass_tint(const Shading& shading);

}  // namespace polymorph
