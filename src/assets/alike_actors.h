// Alike actors: actors that differ at most in position, name and first frame. They share their
// objects and legs (the morphs from one object to the next).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "assets/loaded_scene.h"
#include "scene/load_scene.h"

namespace polymorph {

/// The earlier actor, if any, whose objects and legs an actor shares.
struct SharedActor {
  std::size_t first = 0;  ///< index of the first alike actor; the actor's own index if it is first
  Vec3 offset;            ///< translation from the actor `first` to this one
};

/// Finds for each actor the first alike one. Actors with mesh sequences or blends share nothing.
/// `chain`: chain_objects(scene) (scene/load_scene.h); `loaded`: their models. Returns one entry
/// per actor.
std::vector<SharedActor> find_shared_actors(const Scene& scene, std::span<const ChainObject> chain,
                                            const LoadedScene& loaded);
/// Returns the result for a scene whose actors share nothing: each is its own first actor.
std::vector<SharedActor> unshared_actors(const Scene& scene);

}  // namespace polymorph
