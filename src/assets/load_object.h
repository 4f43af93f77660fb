// Reading of an object of a scene: its file or built-in shape, rotated upright, and the scene's
// materials for it.
#pragma once

#include <string>
#include <vector>

#include "assets/loaded_scene.h"
#include "base/result.h"
#include "scene/scene.h"

namespace polymorph {

/// Makes the rotation that maps the axis `up` of the file to +y.
Transform upright(UpAxis up);

/// An object as it was read, rotated upright.
struct LoadedObject {
  Model model;
  ObjectPlacement placing;  ///< `to_scene` is only upright() until load_models() places the object
};

/// Reads an object. `textures`: whether to read the textures of its materials. `vertices`: whether
/// to set placing.vertices. Adds the reader's warnings to `warnings`. Errors: as load_model().
Result<LoadedObject> load_object(const ObjectSettings& object, bool textures, bool vertices,
                                 std::vector<std::string>& warnings);

/// Applies the crease angle, the colour and the material values that the scene sets for an object.
void apply_materials(Model& model, const ObjectSettings& object);

}  // namespace polymorph
