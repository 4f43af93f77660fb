// Scene preparation before the first frame: models, spheres, balls, plans, camera.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "kernels/engine.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Settings of a preparation that do not belong to the scene.
struct PrepareSettings {
  std::filesystem::path cache = {};  ///< folder of cache files; empty: none
  MemoryLimit limit = {};
  Fits fits = Fits::kMake;            ///< kCached: the result serves only for estimates
  Sharing sharing = Sharing::kAlike;  ///< kNone: every actor's offset is zero
};

/// Prepares a scene. Errors: kInput for models and settings that cannot be used; kResource, also if
/// the scene is estimated to need more than the limit, which is checked once the models are read.
Result<PreparedScene> prepare_scene(const Scene& scene, Engine& engine,
                                    const PrepareSettings& settings = {});

}  // namespace polymorph
