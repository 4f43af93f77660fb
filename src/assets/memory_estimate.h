// Estimate of the peak memory of a run, computed from the scene once its models are read.
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
  /// Models of actors that share the objects of an earlier one (alike_actors.h). They are freed
  /// before the memory of the members below is used.
  std::uint64_t copies = 0;
  std::uint64_t trees = 0;      ///< hierarchies (BVH) for closest points, inside tests and rays
  std::uint64_t fits = 0;       ///< the largest fit of balls, whether or not it is in the cache
  std::uint64_t distances = 0;  ///< grids of distances to models
  std::uint64_t grid_temporaries = 0;  ///< temporary memory while the largest grid is made
  std::uint64_t surfaces = 0;  ///< surfaces between the models, with their hierarchies for rays
  std::uint64_t pictures = 0;  ///< pictures that are traced or written at once
  /// Returns the peak. `copies` are freed before `trees` and all later members, and
  /// `grid_temporaries` before `surfaces` and `pictures`, so the larger of each two counts.
  std::uint64_t total() const {
    const std::uint64_t after_copies =
        trees + fits + distances + std::max(grid_temporaries, surfaces + pictures);
    return program + models + std::max(copies, after_copies);
  }
};

/// Computes the bytes that a model and its textures occupy in memory.
std::uint64_t model_bytes(const Model& model);

/// Estimates the memory for preparing and rendering the scene. `chain`: chain_objects(scene).
/// `loaded`: its objects; models that could not be read are empty. `shared`: find_shared_actors().
/// `pictures`: number of pictures in memory at once; 0: none are rendered.
MemoryEstimate estimate_memory(const Scene& scene, std::span<const ChainObject> chain,
                               const LoadedScene& loaded, std::span<const SharedActor> shared,
                               std::size_t pictures);

/// Limit of a run's memory.
struct MemoryLimit {
  std::uint64_t bytes = 0;   ///< 0: no limit
  std::size_t pictures = 0;  ///< number of pictures that the run has in memory at once
};

/// Checks that no model file, which is read as a whole, is larger than `limit` bytes (0: no limit).
/// Files that cannot be examined pass. Errors: kResource.
Status check_model_files(std::span<const ChainObject> chain, std::uint64_t limit);

/// Checks that the estimate is at most `limit` bytes (0: no limit). Errors: kResource, with the
/// estimate, the limit and the largest item of the estimate.
Status check_memory(const MemoryEstimate& estimate, std::uint64_t limit);

}  // namespace polymorph
