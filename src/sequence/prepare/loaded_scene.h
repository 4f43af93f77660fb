// Loaded scene: the models of its objects, in their places, and the way there from their files.
#pragma once

#include <string>
#include <vector>

#include "base/box.h"
#include "model/model.h"
#include "model/transform.h"

namespace polymorph {

/// The way from an object's file to its place in the scene.
struct ObjectPlacing {
  Transform to_scene;          ///< takes the file's coordinates into the scene
  Box box;                     ///< box in the file's coordinates
  std::vector<Vec3> vertices;  ///< the file's own, where landmarks name any
};

/// The models of all actors, loaded and arranged.
struct LoadedScene {
  std::vector<Model> models;            ///< actor by actor, in chain order
  std::vector<ObjectPlacing> placings;  ///< one per model
  std::vector<std::string> warnings;
};

}  // namespace polymorph
