// How much memory a scene takes, told from its models before search trees, distances, surfaces and
// pictures are made.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "model/model.h"
#include "scene/load_scene.h"
#include "sequence/prepare/alike_actors.h"
#include "sequence/prepare/loaded_scene.h"

namespace polymorph {

/// Bytes, at the worst moment. How near this comes to what is taken: docs/reliability.md.
struct MemoryEstimate {
  std::uint64_t program = 0;    ///< itself, its libraries and what they keep
  std::uint64_t models = 0;     ///< points, faces and pictures, as they are
  std::uint64_t copies = 0;     ///< models of actors that share objects, until those are made
  std::uint64_t trees = 0;      ///< hierarchies (BVH) for closest points, inside tests and rays
  std::uint64_t fits = 0;       ///< the largest of them, whether or not it is in the cache
  std::uint64_t distances = 0;  ///< grids of distances to models
  std::uint64_t making = 0;     ///< beside the grid while the largest of them is made
  std::uint64_t surfaces = 0;   ///< between the models, with their hierarchies for rays
  std::uint64_t pictures = 0;   ///< traced or written at once
  /// The grids are made before there are surfaces: of the two the larger counts.
  std::uint64_t total() const {
    const std::uint64_t objects = trees + fits + distances + std::max(making, surfaces + pictures);
    return program + models + std::max(copies, objects);
  }
};

/// Bytes of a model with its textures.
std::uint64_t model_bytes(const Model& model);

/// Estimates what preparing and showing the scene takes. `loaded`: of the whole chain, some models
/// perhaps empty. `shared`: find_shared_actors(). `pictures`: held at once, none of them if 0.
MemoryEstimate estimate_memory(const Scene& scene, std::span<const ChainObject> chain,
                               const LoadedScene& loaded, std::span<const SharedActor> shared,
                               std::size_t pictures);

/// The memory that a run may take, in bytes (0: no limit), and the number of pictures it holds at
/// once.
struct MemoryLimit {
  std::uint64_t bytes = 0;
  std::size_t pictures = 0;
};

/// Errors (kResource): a model's file alone, which is read whole, is above the limit.
Status check_model_files(std::span<const ChainObject> chain, std::uint64_t limit);

/// Errors (kResource): the estimate is above `limit`, with both numbers and the largest part; 0 is
/// no limit.
Status check_memory(const MemoryEstimate& estimate, std::uint64_t limit);

}  // namespace polymorph
