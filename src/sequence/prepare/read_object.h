// Reading of a scene's object: its file or shape, turned upright, in the look that the scene gives
// it.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "scene/scene.h"
#include "sequence/prepare/loaded_scene.h"

namespace polymorph {

/// The rotation that makes an axis of the file point up.
Transform upright(UpAxis up);

/// An object as it was read, turned upright.
struct ReadObject {
  Model model;
  ObjectPlacing placing;  ///< up to there
};

/// `vertices`: keep the file's own. Errors: those of load_model().
Result<ReadObject> load_object(const ObjectSettings& object, bool textures, bool vertices,
                               std::vector<std::string>& warnings);

/// Gives a model the creases, the colour and the materials that its object has in the scene.
void restyle(Model& model, const ObjectSettings& object);

}  // namespace polymorph
