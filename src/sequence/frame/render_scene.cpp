#include "sequence/frame/render_scene.h"

#include "sequence/prepare/film_settings.h"

namespace polymorph {
namespace {

constexpr float kFirstId = 2;  // 0: no hit; 1: the ground

MaterialLayer material_layer(const ObjectLayer& layer) {
  const PreparedObject& object = *layer.object;
  return {/*corner_uvs=*/{},
          /*triangle_materials=*/{},
          object.model.materials,
          object.model.textures,
          {&object.model, object.outer.get(), /*triangles=*/{}, /*border_index=*/{}},
          layer.materials.get()};
}

/// Ids and labels of an actor's meshes in AOVs.
struct MeshIds {
  float id = kFirstId;            ///< id of the actor's surface; its objects' ids follow
  std::uint32_t first_label = 1;  ///< 0: no hit and the ground
  std::vector<std::string> label_names;
};

/// Makes a mesh with the properties that an actor's surface and model have in common.
RenderMesh common_mesh(const PreparedActor& actor, const ActorGeometry& geometry,
                       const MeshIds& ids) {
  RenderMesh mesh;
  mesh.first_label = ids.first_label;
  mesh.label_names = ids.label_names;
  mesh.progress = geometry.moment.time;  // 0 or 1 in boundary stages
  mesh.moves = geometry.moves;
  mesh.name = actor.name;
  return mesh;
}

/// Replaces a mesh's materials and look by colours of its points, if there are any.
void apply_paint(RenderMesh& mesh, const std::vector<Vec3>& colors) {
  static const Material matte{/*name=*/"", /*color=*/{0, 0, 0}, /*specular=*/{0, 0, 0},
                              /*roughness=*/1};
  if (colors.empty()) return;
  MaterialLayer plain;
  plain.materials = std::span(&matte, 1);
  static_cast<MaterialLayer&>(mesh) = plain;
  mesh.upper_layers.clear();
  mesh.vertex_colors = colors;
  mesh.vertex_color_opacity = 1;
  mesh.look = 0;
}

RenderMesh surface_mesh(const PreparedActor& actor, const ActorGeometry& geometry,
                        const MeshIds& ids) {
  RenderMesh mesh = common_mesh(actor, geometry, ids);
  mesh.positions = geometry.surface.positions;
  mesh.triangles = geometry.surface.triangles;
  mesh.vertex_normals = geometry.surface.normals;
  const std::vector<ObjectLayer>& layers = geometry.look.layers;
  if (!layers.empty()) static_cast<MaterialLayer&>(mesh) = material_layer(layers.front());
  for (std::size_t i = 1; i < layers.size(); ++i)
    mesh.upper_layers.push_back({material_layer(layers[i]), layers[i].opacity});
  mesh.vertex_colors = geometry.look.colors;
  mesh.vertex_color_opacity = geometry.look.color_opacity;
  mesh.look = layers.empty() ? 1.0f : 0.0f;
  mesh.id = ids.id;
  mesh.vertex_labels = geometry.surface_labels;
  mesh.displacement = geometry.flow.displacement;
  mesh.vertex_progress = geometry.flow.progress;
  apply_paint(mesh, geometry.surface_paint);
  return mesh;
}

/// Makes the mesh of the model that the actor shows in this frame.
RenderMesh object_mesh(const PreparedActor& actor, const ActorGeometry& geometry,
                       const MeshIds& ids) {
  const Model& model = shown_model(actor, geometry);
  RenderMesh mesh = common_mesh(actor, geometry, ids);
  mesh.positions = geometry.points;
  mesh.triangles = model.triangles;
  mesh.corner_normals =
      geometry.corner_normals.empty() ? model.corner_normals : geometry.corner_normals;
  mesh.corner_uvs = model.corner_uvs;
  mesh.triangle_materials = model.triangle_materials;
  mesh.materials = model.materials;
  mesh.textures = model.textures;
  mesh.look = geometry.moment.look;
  mesh.id = ids.id + 1 + static_cast<float>(geometry.moment.object);
  mesh.vertex_labels = geometry.point_labels;
  mesh.displacement = geometry.displacement;
  apply_paint(mesh, geometry.point_paint);
  return mesh;
}

}  // namespace

RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry) {
  RenderScene scene;
  const FrameView view = make_frame_view(prepared, geometry.frame);
  scene.camera = view.camera;
  scene.camera_motion = view.camera_motion;
  scene.rig = view.rig;
  scene.lights = view.scene.lights;
  scene.ground = view.ground;
  scene.look = view.scene.look;
  scene.environment = prepared.environment;
  scene.bounds = prepared.box;
  scene.time = geometry.t;
  MeshIds ids;
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    const ActorGeometry& actor_geometry = geometry.actors[a];
    ids.label_names = actor.label_names;
    if (prepared.actors.size() > 1)
      for (std::string& name : ids.label_names) name = actor.name + "." + name;
    if (!actor_geometry.surface.triangles.empty())
      scene.meshes.push_back(surface_mesh(actor, actor_geometry, ids));
    if (!actor_geometry.points.empty())
      scene.meshes.push_back(object_mesh(actor, actor_geometry, ids));
    ids.first_label += static_cast<std::uint32_t>(actor.label_names.size());
    ids.id += 1 + static_cast<float>(actor.objects.size());
  }
  return scene;
}

}  // namespace polymorph
