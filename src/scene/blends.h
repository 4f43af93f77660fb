// Blend of objects: an actor whose objects are mixed by weights, which may have keyframes, instead
// of following each other.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/keyframes.h"
#include "scene/scene.h"

namespace polymorph {

/// Puts the objects of each blend, which have their names, into the order of these, and the tracks
/// of their weights with them ("/actors/0/blend/1/weight", also in a scene without a list of
/// actors). Of objects of one name the files and then the settings decide. So the order of the
/// lists changes nothing.
void sort_blends(Scene& scene);

/// Weights of the objects of an actor's blend at a moment: in [0, 1], their sum is 1; one below a
/// millionth of the sum is 0. All are 0 where the scene's are.
std::vector<float> blend_weights(const Scene& scene, std::size_t actor, const FilmTime& time);

/// Tests whether the actor mixes three objects or more: two are a morph from one to the other,
/// whose time is the second one's weight.
inline bool mixes_many(const ActorSettings& actor) { return actor.blend.size() > 2; }

}  // namespace polymorph
