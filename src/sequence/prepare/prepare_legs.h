// Preparation of an actor's legs: plans between its objects, pacing, and balls in flight between
// legs.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "scene/scene.h"
#include "sequence/prepare/prepare_objects.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Makes the actors with their legs from their outlines and objects; one that is like an earlier
/// one (`shared`, one per actor) gets the legs of that. Appends to `warnings` which landmarks fold
/// the maps of their legs. Errors: kInput where the plan names labels that no object has, or a leg
/// is left without a surface; the engine's.
Result<std::vector<PreparedActor>> make_actors(const Preparation& preparation,
                                               std::span<const ActorOutline> outlines,
                                               std::span<const ObjectList> objects,
                                               std::span<const SharedActor> shared,
                                               std::vector<std::string>& warnings);

/// Plans the way between two of an actor's objects, whether a leg joins them or not. `actor`: its
/// number in the scene.
MorphPlan plan_between(const Preparation& preparation, std::size_t actor,
                       const PreparedObject& from, const PreparedObject& to);

}  // namespace polymorph
