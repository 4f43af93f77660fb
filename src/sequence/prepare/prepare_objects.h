// Preparation of an actor's objects: balls, distances, colours and boundary stages of its models.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "scene/load_scene.h"
#include "sequence/prepare/alike_actors.h"
#include "sequence/prepare/place_landmarks.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The scene that is prepared, with device, cache folder and manner.
struct Preparation {
  const Scene& scene;
  Engine& engine;
  const std::filesystem::path& cache;
  Fits fits = Fits::kMake;
};

/// Completes an object that has its model, balls and their labels; `settings` are those of its
/// actor and `kinds` those of the legs that end at it. Errors: kInput where the balls have no
/// surface or the model encloses nothing; the engine's.
Status finish_object(const Preparation& preparation, const ObjectSettings& chosen,
                     const LegSettings& settings, LegKinds kinds, PreparedObject& object);

/// Outlines of all actors, from the models of the chain. Errors: kInput where an actor's models
/// have no extent.
Result<std::vector<ActorOutline>> outline_actors(const Scene& scene,
                                                 std::span<const ChainObject> chain,
                                                 const LoadedScene& loaded);

/// The objects of each actor, in their reference poses where they move, from the models of the
/// chain, which are moved out of `loaded`, and their landmarks. `shared`: that of each actor; one
/// that is like an earlier one gets the list of that. Errors: kInput where a model has no balls or
/// encloses nothing; the engine's.
Result<std::vector<ObjectList>> make_objects(const Preparation& preparation,
                                             std::span<const ChainObject> chain,
                                             LoadedScene& loaded,
                                             std::span<const PlacedLandmarks> landmarks,
                                             std::span<const ActorOutline> outlines,
                                             std::span<const SharedActor> shared);

}  // namespace polymorph
