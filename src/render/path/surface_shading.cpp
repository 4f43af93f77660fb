#include "render/path/surface_shading.h"

#include <algorithm>
#include <cstring>

namespace polymorph {
namespace {

/// Tests whether the mesh has the same material everywhere.
bool is_uniform(const RenderMesh& mesh) {
  return mesh.vertex_colors.empty() && !any_layer(mesh, [](const MaterialLayer& layer) {
           return !layer.materials.empty() &&
                  !(layer.triangle_materials.empty() && layer.materials.front().texture < 0);
         });
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
  const std::uint32_t first_mesh = hit.mesh[0];
  const RenderMesh& mesh = world.geometry->mesh(first_mesh);
  if (!any(hit.mesh != first_mesh) && (mesh.materials.empty() || is_uniform(mesh)))
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

TexturePoint MaterialBorders::at(std::uint32_t border, float u, float v) const {
  return texture_point(*model, *closest, triangles[border], u, v);
}

TexturePoint texture_point(const MaterialLayer& layer, std::uint32_t triangle, float u, float v) {
  return find_texture_point(layer, triangle, u, v);
}

ShadingOf<Pack3> mixed_shading(const World& world, const MeshHitOf<Pack>& hit) {
  return gather_shading(world, hit,
                        [&](const MeshHit& lane_hit) { return mixed_shading(world, lane_hit); });
}

BsdfOf<Pack3> make_bsdf_at(const World& world, const MeshHitOf<Pack>& hit, const Pack3& normal,
                           const Pack3& view, PackMask matte) {
  Pack weight;
  for (int l = 0; l < kLanes; ++l) weight[l] = look_weight(world.geometry->mesh(hit.mesh[l]));
  const ShadingOf<Pack3> look =
      make_matte_where(matte, broadcast_shading(look_shading(world.look)));
  if (!any(weight < 1.0f)) return make_bsdf(look, look, weight, normal, view);
  const ShadingOf<Pack3> own = gather_shading(world, hit, [&](const MeshHit& lane_hit) {
    const RenderMesh& mesh = world.geometry->mesh(lane_hit.mesh);
    return mesh.materials.empty() ? Shading{} : mesh_shading(mesh, lane_hit);
  });
  return make_bsdf(make_matte_where(matte, own), look, weight, normal, view);
}

}  // namespace polymorph
