// Preparation of an actor's legs: plans between its objects, pacing, and balls in flight.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "scene/scene.h"
#include "sequence/prepare/prepare_objects.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Makes the actors with their legs from their outlines and objects. Appends a warning for each leg
/// whose map is folded by landmarks (leg/map_fold.h). Errors: kInput if the plan names labels
/// that no object has, or a leg has no surface when the next leg takes over its balls; the
/// engine's.
Result<std::vector<PreparedActor>> make_actors(const Preparation& preparation,
                                               std::span<const ActorOutline> outlines,
                                               std::span<const ObjectList> objects,
                                               std::vector<std::string>& warnings);

/// Plans the morph between any two objects of the actor with the index `actor` in the scene, with
/// the default motion.
MorphPlan plan_between(const Preparation& preparation, std::size_t actor,
                       const PreparedObject& from, const PreparedObject& to);

}  // namespace polymorph
