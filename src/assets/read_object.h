// Reading of a scene's object: its file or built-in shape, turned upright, with its materials.
#pragma once

#include <string>
#include <vector>

#include "assets/loaded_scene.h"
#include "base/result.h"
#include "scene/scene.h"

namespace polymorph {

/// Makes the rotation that turns an axis of the file to +y.
Transform upright(UpAxis up);

/// An object as it was read, turned upright.
struct ReadObject {
  Model model;
  ObjectPlacing placing;  ///< transform from the file to `model`, not yet to the scene
};

/// Reads an object. `vertices`: sets placing.vertices. Errors: as load_model().
Result<ReadObject> load_object(const ObjectSettings& object, bool textures, bool vertices,
                               std::vector<std::string>& warnings);

/// Applies the creases, the colour and the materials that the scene sets for an object.
void restyle(Model& model, const ObjectSettings& object);

}  // namespace polymorph
