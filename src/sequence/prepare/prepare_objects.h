// Preparation of an actor's objects: balls, distances, colours and boundary stages of its models.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "assets/alike_actors.h"
#include "assets/place_landmarks.h"
#include "base/result.h"
#include "kernels/engine.h"
#include "scene/load_scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Parameters of a preparation (sequence/prepare/prepare.h).
struct Preparation {
  const Scene& scene;
  Engine& engine;
  const std::filesystem::path& cache;  ///< folder of cache files; empty: none
  Fits fits = Fits::kMake;
};

/// Completes an object whose model, balls and ball labels are set. `chosen`: the scene's settings
/// of the object; `settings`: settings of its actor; `kinds`: kinds of the legs that begin or end
/// at the object. Errors: kInput if the balls have no surface or the model encloses nothing; the
/// engine's.
Status finish_object(const Preparation& preparation, const ObjectSettings& chosen,
                     const LegSettings& settings, LegKinds kinds, PreparedObject& object);

/// Makes the outlines of all actors from the models of the chain. `shared`: one per actor. Errors:
/// kInput if an actor's models have no extent.
Result<std::vector<ActorOutline>> outline_actors(const Scene& scene,
                                                 std::span<const ChainObject> chain,
                                                 const LoadedScene& loaded,
                                                 std::span<const SharedActor> shared);

/// Makes the objects of each actor from the models of the chain, which are moved out of `loaded`,
/// and their landmarks. Mesh sequences in a morph are in their reference poses
/// (MeshSequence::reference). An actor that shares the objects of another gets its list. Errors:
/// kInput if a model has no balls or encloses nothing; the engine's.
Result<std::vector<ObjectList>> make_objects(const Preparation& preparation,
                                             std::span<const ChainObject> chain,
                                             LoadedScene& loaded,
                                             std::span<const PlacedLandmarks> landmarks,
                                             std::span<const ActorOutline> outlines);

}  // namespace polymorph
