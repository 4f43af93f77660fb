#include "render/path/surface_shading.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "image/texture.h"

namespace polymorph {
namespace {

/// Weight of the common look.
float look_weight(const RenderMesh& mesh) {
  return mesh.materials.empty() ? 1.0f : clamp01(mesh.look);
}

bool is_uniform(const MaterialLayer& layer) {
  return layer.triangle_materials.empty() && layer.materials.front().texture < 0;
}
/// Tests whether the mesh has the same material everywhere.
bool is_uniform(const RenderMesh& mesh) {
  return mesh.vertex_colors.empty() && is_uniform(static_cast<const MaterialLayer&>(mesh)) &&
         std::all_of(mesh.over.begin(), mesh.over.end(), [](const MixedLayer& layer) {
           return layer.materials.empty() || is_uniform(layer);
         });
}

Shading layer_shading(const MaterialLayer& layer, const MeshHit& hit) {
  const TexturePoint at = texture_point(layer, hit.triangle, hit.u, hit.v);
  const Material& material = layer.materials[at.material];
  const auto texture = static_cast<std::size_t>(std::max(material.texture, 0));
  if (material.texture < 0 || layer.corner_uvs.empty() || texture >= layer.textures.size() ||
      !layer.textures[texture])
    return own_shading(material, {1, 1, 1});
  return own_shading(material, sample_texture(*layer.textures[texture], at.uv));
}

/// The mesh's own materials, mixed with its other layers.
Shading mesh_shading(const RenderMesh& mesh, const MeshHit& hit) {
  Shading shading = layer_shading(mesh, hit);
  for (const MixedLayer& layer : mesh.over)
    if (!layer.materials.empty() && layer.share > 0)
      shading = mix(shading, layer_shading(layer, hit), clamp01(layer.share));
  if (!mesh.vertex_colors.empty() && mesh.vertex_color_share > 0) {
    const Triangle& t = mesh.triangles[hit.triangle];
    const Vec3* colors = mesh.vertex_colors.data();
    const Vec3 color =
        colors[t.v[0]] * (1 - hit.u - hit.v) + colors[t.v[1]] * hit.u + colors[t.v[2]] * hit.v;
    shading.color = lerp(shading.color, color, clamp01(mesh.vertex_color_share));
  }
  return shading;
}

MeshHit lane(const MeshHitOf<Pack>& hit, int l) {
  return {hit.mesh[l], hit.triangle[l], hit.distance[l], hit.u[l], hit.v[l]};
}

ShadingOf<Pack3> broadcast_shading(const Shading& s) {
  return {broadcast3<Pack3>(s.color),      broadcast3<Pack3>(s.specular),
          broadcast<Pack>(s.roughness),    broadcast<Pack>(s.metallic),
          broadcast<Pack>(s.transmission), broadcast<Pack>(s.ior)};
}

/// Calls compute_shading(hit) for each lane, or once for all if they hit one mesh of uniform
/// material.
template <class F>
ShadingOf<Pack3> gather_shading(const World& world, const MeshHitOf<Pack>& hit,
                                const F& compute_shading) {
  const std::uint32_t first = hit.mesh[0];
  const RenderMesh& mesh = world.geometry->mesh(first);
  if (!any(hit.mesh != first) && (mesh.materials.empty() || is_uniform(mesh)))
    return broadcast_shading(compute_shading(lane(hit, 0)));
  struct Row {
    Shading shading;
    float padding[6] = {};
  };
  Row rows[kLanes];
  const float* starts[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    rows[l].shading = compute_shading(lane(hit, l));
    starts[l] = &rows[l].shading.color.x;
  }
  Pack columns[16];
  load_rows<16>(starts, columns);
  ShadingOf<Pack3> shading;
  static_assert(sizeof shading == 10 * sizeof(Pack) && sizeof(Row) == 16 * sizeof(float));
  std::memcpy(&shading, columns, sizeof shading);
  return shading;
}

}  // namespace

TexturePoint texture_point(const MaterialLayer& layer, std::uint32_t triangle, float u, float v) {
  const MaterialBorders& borders = layer.borders;
  if (!borders.border_of.empty()) {
    const std::uint32_t border = borders.border_of[triangle];
    if (border != TransferredMaterials::kNoBorder)
      return texture_point(*borders.model, *borders.closest, borders.triangles[border], u, v);
  }
  TexturePoint point;
  if (!layer.triangle_materials.empty()) point.material = layer.triangle_materials[triangle];
  if (!layer.corner_uvs.empty()) {
    const Vec2* uv = &layer.corner_uvs[std::size_t{triangle} * 3];
    point.uv = uv[0] * (1 - u - v) + uv[1] * u + uv[2] * v;
  }
  return point;
}

Vec3 glass_tint(const Shading& shading) {
  const Vec3 c = min(shading.color, {1, 1, 1});
  return Vec3{std::sqrt(c.x), std::sqrt(c.y), std::sqrt(c.z)} * shading.transmission;
}

Shading mixed_shading(const World& world, const MeshHit& hit) {
  const RenderMesh& mesh = world.geometry->mesh(hit.mesh);
  const float share = look_weight(mesh);
  if (share >= 1) return look_shading(world.look);
  const Shading own = mesh_shading(mesh, hit);
  return share > 0 ? mix(own, look_shading(world.look), share) : own;
}

ShadingOf<Pack3> mixed_shading(const World& world, const MeshHitOf<Pack>& hit) {
  return gather_shading(world, hit, [&](const MeshHit& one) { return mixed_shading(world, one); });
}

BsdfOf<Pack3> make_bsdf_at(const World& world, const MeshHitOf<Pack>& hit, const Pack3& normal,
                           const Pack3& view, PackMask matte) {
  Pack share;
  for (int l = 0; l < kLanes; ++l) share[l] = look_weight(world.geometry->mesh(hit.mesh[l]));
  const ShadingOf<Pack3> look =
      make_matte_where(matte, broadcast_shading(look_shading(world.look)));
  if (!any(share < 1.0f)) return make_bsdf(look, look, share, normal, view);
  const ShadingOf<Pack3> own = gather_shading(world, hit, [&](const MeshHit& one) {
    const RenderMesh& mesh = world.geometry->mesh(one.mesh);
    return mesh.materials.empty() ? Shading{} : mesh_shading(mesh, one);
  });
  return make_bsdf(make_matte_where(matte, own), look, share, normal, view);
}

}  // namespace polymorph
