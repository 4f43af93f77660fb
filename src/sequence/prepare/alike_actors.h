// Alike actors: those that differ in nothing but their places, names and starts. They share their
// objects and legs.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "scene/load_scene.h"
#include "sequence/prepare/loaded_scene.h"

namespace polymorph {

/// The actor whose objects and legs an actor shares.
struct SharedActor {
  std::size_t first = 0;  ///< index of the first actor that is alike; its own where there is none
  Vec3 offset;            ///< offset from the place of that actor to its own
};

/// Finds for each actor the first one that is alike. Actors with mesh sequences and blends share
/// nothing. `chain`: that of the scene; `loaded`: its models.
std::vector<SharedActor> find_shared_actors(const Scene& scene, std::span<const ChainObject> chain,
                                            const LoadedScene& loaded);
/// Every actor of the scene on its own.
std::vector<SharedActor> unshared_actors(const Scene& scene);

}  // namespace polymorph
