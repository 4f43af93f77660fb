// Landmarks of a scene (plan.landmarks): transformed from the objects' files into the scene and
// moved onto the surfaces. Used by both `check` and `render`.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "assets/loaded_scene.h"
#include "scene/load_scene.h"

namespace polymorph {

/// An object's landmarks by name: points on its surface, in scene coordinates.
using PlacedLandmarks = std::map<std::string, Vec3>;

/// Places the landmarks of each object of the chain. Returns one map per object, which is empty if
/// the object has no landmarks or no faces. Leaves out each landmark that cannot be used, and adds
/// a line with its position in the scene file to `problems`. The reasons are: the model has no such
/// vertex, the point is farther from the surface than a tenth of the diagonal of the object's box,
/// or its distance from an earlier landmark is below a thousandth of that diagonal.
std::vector<PlacedLandmarks> place_landmarks(const Scene& scene, std::span<const ChainObject> chain,
                                             const LoadedScene& loaded,
                                             std::vector<std::string>& problems);

}  // namespace polymorph
