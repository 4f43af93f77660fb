#include "export/surface_frames.h"

#include <algorithm>
#include <deque>
#include <numeric>

#include "base/parallel.h"
#include "image/texture.h"
#include "mesh/closest.h"
#include "mesh/normals.h"
#include "render/materials/materials.h"
#include "sequence/prepare/film_settings.h"

namespace polymorph {
namespace {

/// A layer of a model's materials over a surface.
struct Layer {
  const Model* model;
  std::span<const Vec2> corner_uvs;                   ///< 3 per triangle; empty: no textures
  std::span<const std::uint32_t> triangle_materials;  ///< one per triangle; empty: all are 0
  float weight = 1;                                   ///< weight in the mixture of all layers
};

const Material& layer_material(const Layer& layer, std::size_t triangle) {
  return layer.model
      ->materials[layer.triangle_materials.empty() ? 0 : layer.triangle_materials[triangle]];
}

const Texture* layer_texture(const Layer& layer, const Material& material) {
  if (material.texture < 0 || layer.corner_uvs.empty()) return nullptr;
  const auto& textures = layer.model->textures;
  const auto index = static_cast<std::size_t>(material.texture);
  return index < textures.size() ? textures[index].get() : nullptr;
}

Shading shading_at(const Layer& layer, std::size_t corner) {
  const Material& material = layer_material(layer, corner / 3);
  const Texture* texture = layer_texture(layer, material);
  return own_shading(material,
                     texture ? sample_texture(*texture, layer.corner_uvs[corner]) : Vec3{1, 1, 1});
}

Shading scale(const Shading& s, float factor) {
  return {s.color * factor,    s.specular * factor,     s.roughness * factor,
          s.metallic * factor, s.transmission * factor, s.ior * factor};
}
void add(Shading& sum, const Shading& s) {
  sum.color = sum.color + s.color;
  sum.specular = sum.specular + s.specular;
  sum.roughness += s.roughness;
  sum.metallic += s.metallic;
  sum.transmission += s.transmission;
  sum.ior += s.ior;
}

SurfaceMaterial make_surface_material(const Shading& shading, std::string name) {
  SurfaceMaterial material;
  material.name = std::move(name);
  material.color = shading.color;
  material.roughness = shading.roughness;
  material.metallic = shading.metallic;
  material.transmission = shading.transmission;
  material.ior = shading.ior;
  return material;
}

/// Computes the shading of each point: the mean over the corners of the triangles around it. Corner
/// c is corner c % 3 of triangle c / 3; the corners at point v are corners_around[first_corner[v]]
/// to corners_around[first_corner[v + 1] - 1].
std::vector<Shading> compute_mean_shadings(const SurfaceFrame& frame, std::span<const Layer> layers,
                                           float look_weight, const Shading& look) {
  const std::size_t corners = 3 * frame.triangles.size();
  std::vector<std::uint32_t> first_corner(frame.positions.size() + 1, 0), corners_around(corners);
  for (const Triangle& t : frame.triangles)
    for (const std::uint32_t v : t.v) ++first_corner[v + 1];
  std::partial_sum(first_corner.begin(), first_corner.end(), first_corner.begin());
  std::vector<std::uint32_t> next(first_corner.begin(), first_corner.end() - 1);
  for (std::size_t c = 0; c < corners; ++c)
    corners_around[next[frame.triangles[c / 3].v[c % 3]]++] = static_cast<std::uint32_t>(c);
  std::vector<Shading> shadings(frame.positions.size());
  parallel_for(
      static_cast<std::int64_t>(shadings.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        Shading sum = scale(look, 0);  // all members are 0
        for (std::uint32_t k = first_corner[i]; k < first_corner[i + 1]; ++k)
          for (const Layer& layer : layers)
            if (layer.weight > 0)
              add(sum, scale(shading_at(layer, corners_around[k]), layer.weight));
        const auto count = static_cast<float>(first_corner[i + 1] - first_corner[i]);
        shadings[i] = count > 0 ? mix(scale(sum, 1 / count), look, look_weight) : look;
      },
      /*grain=*/256);
  return shadings;
}

/// Sets colours, materials and texture coordinates of a frame. `look_weight` is the weight of the
/// common look `look`.
void add_looks(const PreparedActor& actor, std::span<const Layer> layers, float look_weight,
               const LookSettings& look, SurfaceFrame& frame) {
  const Shading common = look_shading(look);
  if (layers.empty() || look_weight >= 1) {
    frame.colors.assign(frame.positions.size(), common.color);
    frame.triangle_materials.assign(frame.triangles.size(), 0);
    frame.materials = {make_surface_material(common, "look")};
  } else {
    const std::vector<Shading> shadings = compute_mean_shadings(frame, layers, look_weight, common);
    Shading sum = scale(common, 0);
    for (const Shading& s : shadings) {
      frame.colors.push_back(s.color);
      add(sum, s);
    }
    const auto count = static_cast<float>(std::max<std::size_t>(shadings.size(), 1));
    frame.mixture = make_surface_material(scale(sum, 1 / count), actor.name);
    frame.mixture.color = {1, 1, 1};  // the points have the colours
    frame.is_mixed =
        look_weight > 0 || std::count_if(layers.begin(), layers.end(),
                                         [](const Layer& l) { return l.weight > 0; }) > 1;
  }
  if (layers.empty()) return;
  const Layer& strongest =
      *std::max_element(layers.begin(), layers.end(),
                        [](const Layer& a, const Layer& b) { return a.weight < b.weight; });
  frame.corner_uvs.assign(strongest.corner_uvs.begin(), strongest.corner_uvs.end());
  if (!frame.materials.empty()) return;  // only the common look shows
  frame.triangle_materials.assign(strongest.triangle_materials.begin(),
                                  strongest.triangle_materials.end());
  frame.triangle_materials.resize(frame.triangles.size(), 0);
  for (const Material& material : strongest.model->materials) {
    SurfaceMaterial& surface_material = frame.materials.emplace_back(
        make_surface_material(own_shading(material, {1, 1, 1}), material.name));
    if (layer_texture(strongest, material))
      surface_material.texture =
          strongest.model->textures[static_cast<std::size_t>(material.texture)];
  }
}

/// Tests whether any edge of the model is sharp: whether a corner's normal differs by more than a
/// degree from its point's normal in `smooth_normals`.
bool has_creases(const Model& model, std::span<const Vec3> smooth_normals) {
  constexpr float kMinCosine = 0.9998f;  // cosine of about one degree
  for (std::size_t c = 0; c < model.corner_normals.size(); ++c)
    if (dot(model.corner_normals[c], smooth_normals[model.triangles[c / 3].v[c % 3]]) < kMinCosine)
      return true;
  return false;
}

/// Makes the frame of the model that an actor shows, in the pose of this frame.
SurfaceFrame model_frame(const PreparedActor& actor, const ActorGeometry& geometry,
                         const LookSettings& look) {
  const Model& shown = shown_model(actor, geometry);
  SurfaceFrame frame;
  frame.is_model = true;
  frame.positions = geometry.points;
  frame.triangles = shown.triangles;
  Model posed_model = shown;
  posed_model.points = geometry.points;
  if (!geometry.corner_normals.empty()) posed_model.corner_normals = geometry.corner_normals;
  frame.normals = point_normals(posed_model);
  if (has_creases(posed_model, frame.normals)) frame.corner_normals = posed_model.corner_normals;
  frame.labels = geometry.point_labels;
  if (!geometry.displacement.empty()) frame.velocities = geometry.displacement;
  const Layer layer{&shown, shown.corner_uvs, shown.triangle_materials, 1};
  add_looks(actor, {&layer, 1}, geometry.moment.look, look, frame);
  return frame;
}

/// Changes the velocities, which are still displacements per frame, so that the displaced points
/// lie on the surface of the next frame.
void move_ends_onto(const Mesh& next, SurfaceFrame& frame) {
  if (next.triangles.empty()) return;
  std::vector<Vec3> ends(frame.positions.size());
  for (std::size_t i = 0; i < ends.size(); ++i) ends[i] = frame.positions[i] + frame.velocities[i];
  const std::vector<ClosestPoint> hits =
      ClosestPointQuery(next.positions, next.triangles).closest(ends);
  for (std::size_t i = 0; i < ends.size(); ++i)
    frame.velocities[i] = hits[i].point - frame.positions[i];
}

}  // namespace

SurfaceFrame extracted_frame(const PreparedActor& actor, const ActorGeometry& geometry,
                             const LookSettings& look) {
  SurfaceFrame frame;
  frame.positions = geometry.surface.positions;
  frame.triangles = geometry.surface.triangles;
  frame.normals = geometry.surface.normals;
  frame.velocities = geometry.flow.displacement;
  frame.labels = geometry.surface_labels;
  std::vector<Layer> layers;
  std::deque<TransferredMaterials> materials;  // of the layers, which borrow them
  // Each layer covers the layers below it with the opacity `share`.
  for (const ObjectLayer& over : geometry.look.layers) {
    const Model& model = over.object->model;
    if (model.materials.empty()) continue;  // an unfinished morph has no materials
    for (Layer& below : layers) below.weight *= 1 - over.opacity;
    const TransferredMaterials& shown = materials.emplace_back(over.materials->all());
    layers.push_back(
        {&model, shown.corner_uvs, shown.triangle_materials, layers.empty() ? 1.0f : over.opacity});
  }
  add_looks(actor, layers, layers.empty() ? 1.0f : 0.0f, look, frame);
  const SurfaceLook& surface_look = geometry.look;
  if (!layers.empty() && surface_look.colors.size() == frame.colors.size() &&
      surface_look.color_opacity > 0) {
    frame.is_mixed = true;
    for (std::size_t i = 0; i < frame.colors.size(); ++i)
      frame.colors[i] = lerp(frame.colors[i], surface_look.colors[i], surface_look.color_opacity);
  }
  return frame;
}

void request_attributes(Scene& scene, bool velocities, bool labels) {
  scene.camera.shutter = 0;
  scene.image.aovs = velocities && labels ? "label,motion"
                     : velocities         ? "motion"
                     : labels             ? "label"
                                          : "none";
}

std::vector<SurfaceFrame> surface_frames(const PreparedScene& prepared,
                                         const FrameGeometry& geometry, const FrameGeometry* next) {
  std::vector<SurfaceFrame> frames;
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    const ActorGeometry& actor_geometry = geometry.actors[a];
    const bool is_model =
        actor_geometry.surface.triangles.empty() && !actor_geometry.points.empty();
    const LookSettings& look = prepared.scene.look;
    frames.push_back(is_model ? model_frame(actor, actor_geometry, look)
                              : extracted_frame(actor, actor_geometry, look));
    SurfaceFrame& frame = frames.back();
    if (frame.velocities.empty()) continue;
    if (next) move_ends_onto(shown_mesh(actor, next->actors[a]), frame);
    for (Vec3& v : frame.velocities) v = v * prepared.scene.frames.fps;
  }
  return frames;
}

SurfaceSequence surface_sequence(const PreparedScene& prepared, int first, int last) {
  SurfaceSequence sequence;
  for (const PreparedActor& actor : prepared.actors) {
    sequence.actors.push_back(actor.name);
    sequence.label_names.push_back(actor.label_names);
    if (actor.sequence || actor.poses) sequence.has_corner_normals = true;
    for (const auto& object : actor.objects)
      if (!object->meta && has_creases(object->model, point_normals(object->model)))
        sequence.has_corner_normals = true;
  }
  sequence.fps = prepared.scene.frames.fps;
  sequence.first_frame = first;
  sequence.last_frame = last;
  sequence.cameras.clear();
  for (int frame = first; frame <= last; ++frame) {
    const Camera camera = make_frame_view(prepared, frame).camera;
    sequence.cameras.push_back({camera.position, camera.right, camera.up, camera.forward,
                                camera.tan_half_fov_y,
                                static_cast<float>(prepared.scene.image.width) /
                                    static_cast<float>(prepared.scene.image.height),
                                camera.focus});
    if (!prepared.framing) break;  // the camera does not move
  }
  return sequence;
}

}  // namespace polymorph
