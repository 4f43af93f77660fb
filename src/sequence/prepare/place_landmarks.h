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

/// The landmarks of each object of the chain. Adds a line, with its place in the scene file, to
/// `problems` for each that is a vertex which the file does not have, or farther from the surface
/// than a tenth of the object's size, or in the place of another.
std::vector<PlacedLandmarks> place_landmarks(const Scene& scene, std::span<const ChainObject> chain,
                                             const LoadedScene& loaded,
                                             std::vector<std::string>& problems);

}  // namespace polymorph
