// Blend: an actor that mixes its objects by weights, which may have keyframes, instead of morphing
// from one to the next.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/keyframes.h"
#include "scene/scene.h"

namespace polymorph {

/// Sorts the objects of each blend by name, then file, then settings, so that the order in the
/// scene file changes nothing. Adapts the pointers of their weights' keyframe tracks to the new
/// order, in the form "/actors/0/blend/1/weight" even if the scene file has no list of actors. All
/// objects must have names.
void sort_blends(Scene& scene);

/// Computes the weights of an actor's blend at a time, in [0, 1] with sum 1. Weights below a
/// millionth of the sum become 0. If all weights are 0 at this time, the result is all 0.
std::vector<float> blend_weights(const Scene& scene, std::size_t actor, const FilmTime& time);

/// Tests whether the actor mixes three objects or more. A blend of two is a morph whose time is the
/// second object's weight.
inline bool mixes_many(const ActorSettings& actor) { return actor.blend.size() > 2; }

}  // namespace polymorph
