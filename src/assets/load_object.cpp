#include "assets/load_object.h"

#include "base/activity.h"
#include "mesh/normals.h"
#include "model/load/load_model.h"
#include "model/shapes.h"

namespace polymorph {
namespace {

/// Gives all faces one material of this colour.
void paint(Model& model, Vec3 color) {
  Material material;
  material.name = "color";
  material.color = color;
  model.materials = {material};
  model.triangle_materials.assign(model.triangles.size(), 0);
  model.textures.clear();
}

}  // namespace

Transform upright(UpAxis up) {
  const Vec3 degrees = up == UpAxis::kZ   ? Vec3{-90, 0, 0}
                       : up == UpAxis::kX ? Vec3{0, 0, 90}
                                          : Vec3{};
  return make_transform({}, degrees, {1, 1, 1});
}

Result<LoadedObject> load_object(const ObjectSettings& object, bool textures, bool vertices,
                                 std::vector<std::string>& warnings) {
  LoadedObject read;
  if (!object.shape.empty()) {
    PM_TRY(read.model, make_shape(object.shape));
    read.placing.box = read.model.box();
    if (vertices) read.placing.vertices = read.model.points;
    return read;
  }
  const Activity activity("reading " + object.model.filename().string());
  LoadObjSettings settings;
  settings.textures = textures;
  settings.vertices = vertices;
  PM_TRY(LoadedModel loaded, load_model(object.model, settings));
  warnings.insert(warnings.end(), loaded.warnings.begin(), loaded.warnings.end());
  read.placing.box = loaded.model.box();
  read.placing.vertices = std::move(loaded.vertices);
  read.model = std::move(loaded.model);
  if (object.up == UpAxis::kY) return read;
  read.placing.to_scene = upright(object.up);
  read.model = transformed(read.model, read.placing.to_scene);
  return read;
}

void apply_materials(Model& model, const ObjectSettings& object) {
  if (object.crease) model.corner_normals = creased_normals(model, *object.crease);
  if (object.color) paint(model, *object.color);
  for (Material& material : model.materials) {
    material.roughness = object.roughness.value_or(material.roughness);
    material.metallic = object.metallic.value_or(material.metallic);
    material.transmission = object.glass.value_or(material.transmission);
  }
}

}  // namespace polymorph
