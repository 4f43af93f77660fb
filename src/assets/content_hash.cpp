#include "assets/content_hash.h"

#include "base/hash.h"
#include "image/image_io.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

void add(Hasher& hasher, Vec3 v) { hasher.add(v.x).add(v.y).add(v.z); }

/// Adds a material. Structured bindings, here and below, make it a compiler error to forget a new
/// member.
void add(Hasher& hasher, const Material& material) {
  const auto& [name, color, specular, roughness, metallic, transmission, ior, texture] = material;
  add(hasher, color);
  add(hasher, specular);
  hasher.add(roughness).add(metallic).add(transmission).add(ior).add(texture);
}

void add(Hasher& hasher, const Model& model) {
  const auto& [name, points, triangles, corner_normals, corner_uvs, labels, label_names,
               triangle_materials, materials, textures] = model;
  hasher.add(std::span<const Vec3>(points)).add(std::span<const Triangle>(triangles));
  hasher.add(std::span<const Vec3>(corner_normals)).add(std::span<const Vec2>(corner_uvs));
  hasher.add(std::span<const std::uint32_t>(labels)).add(label_names.size());
  for (const std::string& label : label_names) hasher.add(std::string_view(label));
  hasher.add(std::span<const std::uint32_t>(triangle_materials)).add(materials.size());
  for (const Material& material : materials) add(hasher, material);
  hasher.add(textures.size());
  for (const auto& texture : textures) hasher.add(pixel_digest(*texture));
}

/// Returns the object's mesh sequence; null if it is none.
const MeshSequence* find_sequence(const SceneInputs& inputs, std::size_t object) {
  return inputs.sequences.empty() ? nullptr : inputs.sequences[object].get();
}

/// Returns the scene with the settings that content_hash() ignores set to their defaults.
Scene reset_ignored_settings(const Scene& scene) {
  Scene settings = scene;
  settings.output = {};
  settings.description.clear();
  settings.path.clear();
  settings.lights.environment.clear();
  for (ActorSettings& actor : settings.actors)
    for_each_object(actor, [](ObjectSettings& object) { object.model.clear(); });
  return settings;
}

}  // namespace

std::string model_digest(const Model& model) {
  Hasher hasher;
  add(hasher, model);
  return hasher.hex();
}

std::string inputs_hash(const SceneInputs& inputs, std::string_view program) {
  Hasher hasher;
  hasher.add(program);
  // Names decide which labels match (plan.labels), and are written into the frames' headers.
  for (const std::span<const ChainObject> chain : actor_chains(inputs.chain)) {
    hasher.add(std::string_view(chain.front().actor->name));
    for (const ChainObject& object : chain) hasher.add(std::string_view(object.settings->name));
  }
  hasher.add(inputs.models.size());
  for (std::size_t i = 0; i < inputs.models.size(); ++i) {
    const Model& model = inputs.models[i];
    // The model of a sequence is a stand-in (LoadedScene::models). content_hash() adds the meshes.
    if (!find_sequence(inputs, i))
      add(hasher, model);
    else
      for (const std::string& label : model.label_names) hasher.add(std::string_view(label));
  }
  for (const ObjectPlacement& placing : inputs.placements)
    if (!placing.vertices.empty()) hasher.add(std::span<const Vec3>(placing.vertices));
  hasher.add(inputs.environment != nullptr);
  if (inputs.environment) hasher.add(pixel_digest(*inputs.environment));
  return hasher.hex();
}

std::string settings_text(const Scene& scene) {
  return scene_to_json(reset_ignored_settings(scene), /*folder=*/{});
}

std::string content_hash(const SceneInputs& inputs, std::string_view program) {
  Hasher hasher;
  hasher.add(inputs_hash(inputs, program)).add(settings_text(inputs.scene));
  for (std::size_t i = 0; i < inputs.models.size(); ++i)
    if (const MeshSequence* sequence = find_sequence(inputs, i))
      for (const MeshFile& file : sequence->files)
        hasher.add(std::string_view(file.digest + file.velocities));
  return hasher.hex();
}

}  // namespace polymorph
