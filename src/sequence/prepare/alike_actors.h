// Alike actors: those that differ in nothing but their places, names and starts.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "scene/load_scene.h"
#include "sequence/prepare/loaded_scene.h"

namespace polymorph {

/// The actor whose objects and legs another one shows, too, and how far from there.
struct SharedActor {
  std::size_t first = 0;  ///< index of the first actor that is alike: itself where there is none
  Vec3 offset;            ///< offset from the place of that one to this one's
};

/// Finds for each actor the first that it is alike. Actors with mesh sequences, and those that mix
/// many objects, are alike nobody. `chain`: that of the scene; `loaded`: its models.
std::vector<SharedActor> find_shared_actors(const Scene& scene, std::span<const ChainObject> chain,
                                            const LoadedScene& loaded);
/// Every actor of the scene on its own.
std::vector<SharedActor> unshared_actors(const Scene& scene);

}  // namespace polymorph
