// Scene preparation before the first frame: models, spheres, balls, plans, camera.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "kernels/engine.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Prepares a scene. `cache_folder`: folder of cache files; empty: none. With Fits::kCached the
/// result serves only for estimates. With Sharing::kNone every actor's offset is zero. Errors:
/// kInput for models and settings that cannot be used; kResource, also if the scene is estimated to
/// need more than `limit`, which is checked once the models are read.
Result<PreparedScene> prepare_scene(const Scene& scene, Engine& engine,
                                    const std::filesystem::path& cache_folder,
                                    const MemoryLimit& limit = {}, Fits fits = Fits::kMake,
                                    Sharing sharing = Sharing::kAlike);

}  // namespace polymorph
