// Estimate of a scene's peak memory, made once its models are read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "assets/alike_actors.h"
#include "assets/loaded_scene.h"
#include "base/result.h"
#include "model/model.h"
#include "scene/load_scene.h"

namespace polymorph {

/// Estimated peak memory in bytes. docs/reliability.md compares it with measurements.
struct MemoryEstimate {
  std::uint64_t program = 0;  ///< the program, its libraries and their caches
  std::uint64_t models = 0;   ///< points, faces and textures
  std::uint64_t copies = 0;   ///< models of actors that share objects, freed when objects are made
  std::uint64_t trees = 0;    ///< hierarchies (BVH) for closest points, inside tests and rays
  std::uint64_t fits = 0;     ///< the largest fit of balls, whether or not it is in the cache
  std::uint64_t distances = 0;  ///< grids of distances to models
  std::uint64_t making = 0;     ///< temporary memory while the largest grid is made
  std::uint64_t surfaces = 0;   ///< surfaces between the models, with their hierarchies for rays
  std::uint64_t pictures = 0;   ///< pictures that are traced or written at once
  /// Returns the peak. `copies` are freed before any of trees, fits, distances and so on are made,
  /// and `making` is freed before surfaces and pictures; the larger of each two counts.
  std::uint64_t total() const {
    const std::uint64_t objects = trees + fits + distances + std::max(making, surfaces + pictures);
    return program + models + std::max(copies, objects);
  }
};

/// Computes the bytes of a model with its textures.
std::uint64_t model_bytes(const Model& model);

/// Estimates the memory for preparing and rendering the scene. `loaded`: the whole chain; models
/// that could not be read are empty. `shared`: find_shared_actors(). `pictures`: number held at
/// once; 0: none are rendered.
MemoryEstimate estimate_memory(const Scene& scene, std::span<const ChainObject> chain,
                               const LoadedScene& loaded, std::span<const SharedActor> shared,
                               std::size_t pictures);

/// Limit of a run's memory.
struct MemoryLimit {
  std::uint64_t bytes = 0;   ///< 0: no limit
  std::size_t pictures = 0;  ///< number of pictures that the run holds at once
};

/// Checks that no model file (read whole) is larger than `limit` bytes. Errors: kResource.
Status check_model_files(std::span<const ChainObject> chain, std::uint64_t limit);

/// Checks that the estimate is at most `limit` bytes (0: no limit). Errors: kResource, with both
/// numbers and the largest part.
Status check_memory(const MemoryEstimate& estimate, std::uint64_t limit);

}  // namespace polymorph
