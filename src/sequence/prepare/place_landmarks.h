// Landmarks of a scene (plan.landmarks), carried from the objects' files onto their surfaces in the
// scene; used by both `check` and `render`.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "scene/load_scene.h"
#include "sequence/prepare/loaded_scene.h"

namespace polymorph {

/// An object's landmarks by name: places on its surface, in the scene.
using PlacedLandmarks = std::map<std::string, Vec3>;

/// Places the landmarks of each object of the chain. Adds a line to `problems`, with the position
/// in the scene file, for each landmark that cannot be used: a vertex that the model does not have,
/// a point farther from the surface than a tenth of the object's size, or the place of another
/// landmark.
std::vector<PlacedLandmarks> place_landmarks(const Scene& scene, std::span<const ChainObject> chain,
                                             const LoadedScene& loaded,
                                             std::vector<std::string>& problems);

}  // namespace polymorph
