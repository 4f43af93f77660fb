#include "render/path/surface_shading.h"

#include <algorithm>
#include <cstring>

namespace polymorph {
namespace {

/// Tests whether the mesh has the same material everywhere.
bool is_uniform(const RenderMesh& mesh) {
  return mesh.vertex_colors.empty() && !any_layer(mesh, [](const MaterialLayer& layer) {
           if (layer.materials.empty()) return false;
           if (layer.transfer) return !layer.transfer->is_uniform();
           return !(layer.triangle_materials.empty() && layer.materials.front().texture < 0);
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

/// Counterpart of select() for shadings.
ShadingOf<Pack3> select_shading(PackMask first, const ShadingOf<Pack3>& a,
                                const ShadingOf<Pack3>& b) {
  return {select(first, a.color, b.color),
          select(first, a.specular, b.specular),
          select(first, a.roughness, b.roughness),
          select(first, a.metallic, b.metallic),
          select(first, a.transmission, b.transmission),
          select(first, a.ior, b.ior)};
}

/// Eight shadings as rows, padded to whole packs.
struct ShadingRows {
  struct Row {
    Shading shading;
    float padding[6] = {};
  };
  Row rows[kLanes];

  ShadingOf<Pack3> transposed() const {
    const float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l) starts[l] = &rows[l].shading.color.x;
    Pack columns[16];
    load_rows<16>(starts, columns);
    ShadingOf<Pack3> shading;
    static_assert(sizeof shading == 10 * sizeof(Pack) && sizeof(Row) == 16 * sizeof(float));
    std::memcpy(&shading, columns, sizeof shading);
    return shading;
  }
};

/// Rounds down, as std::floor() does.
Pack floor(Pack a) {
  const Pack truncated = to_float(truncate(a));
  const Pack rounded = truncated - zero_unless(truncated > a, broadcast<Pack>(1));
  return select(abs(a) < 0x1p23f, rounded, a);  // larger numbers are whole; truncate() may overflow
}

/// Counterpart of texture_taps() (image/texture.h) for eight texture coordinates: along one axis,
/// the indices of the two texels around each coordinate, and the weight of the second.
struct PackTaps {
  alignas(32) std::int32_t first[kLanes], second[kLanes];
  alignas(32) float fraction[kLanes];

  /// `t`: the coordinates; `size`: number of texels of the axis.
  PackTaps(Pack t, int size) {
    const Pack n = broadcast<Pack>(static_cast<float>(size));
    const Pack position = zero_unless(abs(t) < kInfinity, (t - floor(t)) * n - 0.5f);
    const Pack lower = floor(position);
    const PackMask zero{}, i = truncate(lower);
    const PackMask wrapped = i < 0 ? zero + (size - 1) : (i < size ? i : zero);
    const PackMask next = wrapped + 1;
    store(wrapped, first);
    store(next < size ? next : zero, second);
    Lanes<Pack>::store(fraction, position - lower);
  }

 private:
  static void store(PackMask from, std::int32_t* to) { std::memcpy(to, &from, sizeof from); }
};

/// Samples a texture at eight points, as sample_texture() does at one. A texel has an unused fourth
/// float, so that one instruction mixes two.
void sample_texture(TextureView texture, Pack2 uv, Vec3 (&texels)[kLanes]) {
  const PackTaps x(uv.x, texture.width), y(1.0f - uv.y, texture.height);
  for (int l = 0; l < kLanes; ++l) {
    const auto load = [&](std::int32_t column, std::int32_t row) {
      const Vec3 texel =
          texture.texel(static_cast<std::size_t>(column), static_cast<std::size_t>(row));
      return Quad{texel.x, texel.y, texel.z, 0};
    };
    const auto mix_quads = [](Quad a, Quad b, float t) { return a + (b - a) * t; };
    const float fx = x.fraction[l];
    const Quad above = mix_quads(load(x.first[l], y.first[l]), load(x.second[l], y.first[l]), fx);
    const Quad below = mix_quads(load(x.first[l], y.second[l]), load(x.second[l], y.second[l]), fx);
    const Quad texel = mix_quads(above, below, y.fraction[l]);
    texels[l] = {texel[0], texel[1], texel[2]};
  }
}

/// Returns the texture of a material, or null if it has none.
const Texture* find_texture(const MaterialLayer& layer, const Material& material) {
  const auto texture = static_cast<std::size_t>(std::max(material.texture, 0));
  if (material.texture < 0 || !layer.has_uvs() || texture >= layer.textures.size()) return nullptr;
  return layer.textures[texture].get();
}

/// Looks up the shading parameters of a layer at eight hits of one mesh.
ShadingOf<Pack3> layer_shading(const MaterialLayer& layer, const MeshHitOf<Pack>& hit) {
  const Material* materials[kLanes];
  const Texture* textures[kLanes];
  Pack2 uv;
  bool is_one_texture = true;
  for (int l = 0; l < kLanes; ++l) {
    const TexturePoint point = texture_point(layer, hit.triangle[l], hit.u[l], hit.v[l]);
    uv.x[l] = point.uv.x, uv.y[l] = point.uv.y;
    materials[l] = &layer.materials[point.material];
    textures[l] = find_texture(layer, *materials[l]);
    is_one_texture = is_one_texture && textures[l] == textures[0];
  }
  // If possible, one texture is sampled at eight points at once. Without a texture, texels are
  // white.
  Vec3 texels[kLanes];
  if (is_one_texture && textures[0] && !textures[0]->view().empty())
    sample_texture(textures[0]->view(), uv, texels);
  else
    for (int l = 0; l < kLanes; ++l)
      texels[l] =
          textures[l] ? sample_texture(*textures[l], Vec2{uv.x[l], uv.y[l]}) : Vec3{1, 1, 1};
  ShadingRows own;
  for (int l = 0; l < kLanes; ++l) own.rows[l].shading = own_shading(*materials[l], texels[l]);
  return own.transposed();
}

/// Computes mesh_shading() at eight hits of one mesh.
ShadingOf<Pack3> mesh_shading(const RenderMesh& mesh, const MeshHitOf<Pack>& hit) {
  if (is_uniform(mesh)) return broadcast_shading(mesh_shading(mesh, lane(hit, 0)));
  ShadingOf<Pack3> shading = layer_shading(mesh, hit);
  for (const MixedLayer& layer : mesh.upper_layers)
    if (!layer.materials.empty() && layer.opacity > 0)
      shading = mix(shading, layer_shading(layer, hit), broadcast<Pack>(clamp01(layer.opacity)));
  if (!mesh.vertex_colors.empty() && mesh.vertex_color_opacity > 0) {
    Pack3 color;
    for (int l = 0; l < kLanes; ++l) {
      const Triangle& t = mesh.triangles[hit.triangle[l]];
      const Vec3* colors = mesh.vertex_colors.data();
      const float u = hit.u[l], v = hit.v[l];
      set_lane(color, l, colors[t.v[0]] * (1 - u - v) + colors[t.v[1]] * u + colors[t.v[2]] * v);
    }
    shading.color = lerp(shading.color, color, broadcast<Pack>(clamp01(mesh.vertex_color_opacity)));
  }
  return shading;
}

/// Returns the mesh that all lanes hit, or null if they hit several.
const RenderMesh* find_only_mesh(const World& world, const MeshHitOf<Pack>& hit) {
  const std::uint32_t first_mesh = hit.mesh[0];
  return any(hit.mesh != first_mesh) ? nullptr : &world.geometry->mesh(first_mesh);
}

/// Returns look_weight() of each lane's mesh.
Pack look_weights(const World& world, const MeshHitOf<Pack>& hit) {
  Pack weights;
  for (int l = 0; l < kLanes; ++l) weights[l] = look_weight(world.geometry->mesh(hit.mesh[l]));
  return weights;
}

}  // namespace

TexturePoint MaterialBorders::at(std::uint32_t border, float u, float v) const {
  return texture_point(*model, *closest, triangles[border], u, v);
}

TexturePoint texture_point(const MaterialLayer& layer, std::uint32_t triangle, float u, float v) {
  return layer.transfer ? layer.transfer->at(triangle, u, v)
                        : find_texture_point(layer, triangle, u, v);
}

ShadingOf<Pack3> own_shading(const World& world, const MeshHitOf<Pack>& hit) {
  const auto shade = [](const RenderMesh& mesh, const auto& hits) {
    using Result = decltype(mesh_shading(mesh, hits));
    return look_weight(mesh) < 1 ? mesh_shading(mesh, hits) : Result{};
  };
  if (const RenderMesh* mesh = find_only_mesh(world, hit)) return shade(*mesh, hit);
  ShadingRows shadings;
  for (int l = 0; l < kLanes; ++l)
    shadings.rows[l].shading = shade(world.geometry->mesh(hit.mesh[l]), lane(hit, l));
  return shadings.transposed();
}

ShadingOf<Pack3> mixed_shading(const World& world, const MeshHitOf<Pack>& hit,
                               const ShadingOf<Pack3>& own) {
  const Pack weight = look_weights(world, hit);
  const ShadingOf<Pack3> look = broadcast_shading(look_shading(world.look));
  const ShadingOf<Pack3> mixed = select_shading(weight > 0.0f, mix(own, look, weight), own);
  return select_shading(weight < 1.0f, mixed, look);
}

BsdfOf<Pack3> make_bsdf_at(const World& world, const MeshHitOf<Pack>& hit,
                           const ShadingOf<Pack3>& own, const Pack3& normal, const Pack3& view,
                           PackMask matte) {
  const Pack weight = look_weights(world, hit);
  const ShadingOf<Pack3> look =
      make_matte_where(matte, broadcast_shading(look_shading(world.look)));
  if (!any(weight < 1.0f)) return make_bsdf(look, look, weight, normal, view);
  return make_bsdf(make_matte_where(matte, own), look, weight, normal, view);
}

}  // namespace polymorph
