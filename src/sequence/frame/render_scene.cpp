#include "sequence/frame/render_scene.h"

#include "sequence/prepare/film_settings.h"

namespace polymorph {
namespace {

constexpr float kFirstId = 2;  // 0 is nothing, 1 the ground

MaterialLayer material_layer(const ObjectLayer& layer) {
  const PreparedObject& object = *layer.object;
  const TransferredMaterials& materials = layer.materials;
  return {materials.corner_uvs,
          materials.triangle_materials,
          object.model.materials,
          object.model.textures,
          {&object.model, object.outer.get(), materials.borders, materials.border_of}};
}

/// The actor's meshes; `id` is its surface's, its objects' follow. `first_label`: of the layer.
void add_meshes(const PreparedActor& actor, const ActorGeometry& geometry, float id,
                std::uint32_t first_label, const std::vector<std::string>& label_names,
                RenderScene& scene) {
  if (!geometry.surface.triangles.empty()) {
    RenderMesh mesh;
    mesh.positions = geometry.surface.positions;
    mesh.triangles = geometry.surface.triangles;
    mesh.vertex_normals = geometry.surface.normals;
    const std::vector<ObjectLayer>& layers = geometry.look.layers;
    if (!layers.empty()) static_cast<MaterialLayer&>(mesh) = material_layer(layers.front());
    for (std::size_t i = 1; i < layers.size(); ++i)
      mesh.over.push_back({material_layer(layers[i]), layers[i].share});
    mesh.vertex_colors = geometry.look.colors;
    mesh.vertex_color_share = geometry.look.color_share;
    mesh.look = layers.empty() ? 1.0f : 0.0f;
    mesh.id = id;
    mesh.vertex_labels = geometry.surface_labels;
    mesh.first_label = first_label;
    mesh.displacement = geometry.flow.displacement;
    mesh.vertex_progress = geometry.flow.progress;
    mesh.progress = geometry.moment.time;  // 0 and 1 on the ways out of and into a model
    mesh.moves = geometry.moves;
    mesh.name = actor.name;
    mesh.label_names = label_names;
    scene.meshes.push_back(mesh);
  }
  if (!geometry.points.empty()) {
    const Model& model = object_of(actor, geometry.moment.object).model;
    RenderMesh mesh;
    mesh.positions = geometry.points;
    mesh.triangles = model.triangles;
    mesh.corner_normals =
        geometry.corner_normals.empty() ? model.corner_normals : geometry.corner_normals;
    mesh.corner_uvs = model.corner_uvs;
    mesh.triangle_materials = model.triangle_materials;
    mesh.materials = model.materials;
    mesh.textures = model.textures;
    mesh.look = geometry.moment.look;
    mesh.id = id + 1 + static_cast<float>(geometry.moment.object);
    mesh.vertex_labels = geometry.point_labels;
    mesh.first_label = first_label;
    mesh.displacement = geometry.displacement;
    mesh.progress = geometry.moment.time;
    mesh.moves = geometry.moves;
    mesh.name = actor.name;
    mesh.label_names = label_names;
    scene.meshes.push_back(mesh);
  }
}

}  // namespace

RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry) {
  RenderScene scene;
  const FrameView view = view_of(prepared, geometry.frame);
  scene.camera = view.camera;
  scene.camera_motion = view.camera_motion;
  scene.rig = view.rig;
  scene.lights = view.scene.lights;
  scene.ground = view.ground;
  scene.look = view.scene.look;
  scene.environment = prepared.environment;
  scene.bounds = prepared.box;
  scene.moment = geometry.t;
  float id = kFirstId;
  std::uint32_t label = 1;  // 0 is nothing and the ground
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    std::vector<std::string> names = prepared.actors[a].label_names;
    if (prepared.actors.size() > 1)
      for (std::string& name : names) name = prepared.actors[a].name + "." + name;
    add_meshes(prepared.actors[a], geometry.actors[a], id, label, names, scene);
    label += static_cast<std::uint32_t>(prepared.actors[a].label_names.size());
    id += 1 + static_cast<float>(prepared.actors[a].objects.size());
  }
  return scene;
}

}  // namespace polymorph
