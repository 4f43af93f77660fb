// Material lookup: the shading parameters of a mesh at a ray's hit.
#pragma once

#include <algorithm>
#include <cmath>

#include "image/texture.h"
#include "render/materials/materials.h"
#include "render/path/world.h"

namespace polymorph {

/// Looks up material and texture coordinates at a point of a triangle; texture_point() of each kind
/// of layer calls it. On a triangle that crosses a border of texture charts or materials
/// (model/transfer.h), they are looked up in the model from which the layer's materials were
/// transferred.
template <class Layer>
PM_HD TexturePoint find_texture_point(const Layer& layer, std::uint32_t triangle, float u,
                                      float v) {
  if (!layer.borders.border_index.empty()) {
    const std::uint32_t border = layer.borders.border_index[triangle];
    if (border != TransferredMaterials::kNoBorder) return layer.borders.at(border, u, v);
  }
  TexturePoint point;
  if (!layer.triangle_materials.empty()) point.material = layer.triangle_materials[triangle];
  if (!layer.corner_uvs.empty()) {
    const Vec2* uv = &layer.corner_uvs[std::size_t{triangle} * 3];
    point.uv = uv[0] * (1 - u - v) + uv[1] * u + uv[2] * v;
  }
  return point;
}

/// Returns the weight of RenderScene::look at the mesh's surface: 1 without own materials.
template <class Mesh>
PM_HD float look_weight(const Mesh& mesh) {
  return mesh.materials.empty() ? 1.0f : clamp01(mesh.look);
}

/// Looks up the shading parameters of a layer at a hit.
template <class Layer>
PM_HD_CALL Shading layer_shading(const Layer& layer, const MeshHit& hit) {
  const TexturePoint point = texture_point(layer, hit.triangle, hit.u, hit.v);
  const auto& material = layer.materials[point.material];
  const auto texture = static_cast<std::size_t>(std::max(material.texture, 0));
  if (material.texture < 0 || !layer.has_uvs() || texture >= layer.textures.size() ||
      !layer.textures[texture])
    return own_shading(material, {1, 1, 1});
  return own_shading(material, sample_texture(*layer.textures[texture], point.uv));
}

/// Looks up the mesh's own materials, mixed with the layers over them and with the vertex colours.
template <class Mesh>
PM_HD Shading mesh_shading(const Mesh& mesh, const MeshHit& hit) {
  Shading shading = layer_shading(mesh, hit);
  for (const auto& layer : mesh.upper_layers)
    if (!layer.materials.empty() && layer.opacity > 0)
      shading = mix(shading, layer_shading(layer, hit), clamp01(layer.opacity));
  if (!mesh.vertex_colors.empty() && mesh.vertex_color_opacity > 0) {
    const Triangle& t = mesh.triangles[hit.triangle];
    const Vec3* colors = mesh.vertex_colors.data();
    const Vec3 color =
        colors[t.v[0]] * (1 - hit.u - hit.v) + colors[t.v[1]] * hit.u + colors[t.v[2]] * hit.v;
    shading.color = lerp(shading.color, color, clamp01(mesh.vertex_color_opacity));
  }
  return shading;
}

/// Mixes mesh_shading() with RenderScene::look to one material, for glass and the AOVs.
template <class Mesh>
PM_HD_CALL Shading mixed_shading(const World& world, const Mesh& mesh, const MeshHit& hit) {
  const float weight = look_weight(mesh);
  if (weight >= 1) return look_shading(world.look);
  const Shading own = mesh_shading(mesh, hit);
  return weight > 0 ? mix(own, look_shading(world.look), weight) : own;
}

/// Makes the BSDF at a hit, with lobes of both mesh_shading() and RenderScene::look. If `matte`,
/// gloss is replaced by diffuse reflection of the same colour.
template <class Mesh>
PM_HD_CALL Bsdf make_bsdf_at(const World& world, const Mesh& mesh, const MeshHit& hit, Vec3 normal,
                             Vec3 view, bool matte) {
  const float weight = look_weight(mesh);
  const Shading look = make_matte_where<Vec3>(matte, look_shading(world.look));
  if (!(weight < 1.0f)) return make_bsdf(look, look, weight, normal, view);
  const Shading own = mesh_shading(mesh, hit);
  return make_bsdf(make_matte_where<Vec3>(matte, own), look, weight, normal, view);
}

/// Returns the fraction of light that glass transmits at one boundary, without Fresnel reflection.
/// Two boundaries give the full colour.
PM_HD inline Vec3 glass_tint(const Shading& shading) {
  const Vec3 c = min(shading.color, {1, 1, 1});
  return Vec3{std::sqrt(c.x), std::sqrt(c.y), std::sqrt(c.z)} * shading.transmission;
}

#if defined(PM_PACKS)
inline Shading mixed_shading(const World& world, const MeshHit& hit) {
  return mixed_shading(world, world.geometry->mesh(hit.mesh), hit);
}
/// Computes mesh_shading() at eight hits; zeros where a mesh shows only RenderScene::look.
ShadingOf<Pack3> own_shading(const World& world, const MeshHitOf<Pack>& hit);
/// Computes mixed_shading() and make_bsdf_at() at eight hits. `own`: own_shading().
ShadingOf<Pack3> mixed_shading(const World& world, const MeshHitOf<Pack>& hit,
                               const ShadingOf<Pack3>& own);
BsdfOf<Pack3> make_bsdf_at(const World& world, const MeshHitOf<Pack>& hit,
                           const ShadingOf<Pack3>& own, const Pack3& normal, const Pack3& view,
                           PackMask matte);
#endif

}  // namespace polymorph
