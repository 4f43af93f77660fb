// Scene preparation before the first frame: models, spheres, balls, plans, camera.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "kernels/engine.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// Prepares a scene. `cache_folder` empty: no sphere cache. With Fits::kCached the result is good
/// for estimates alone. Errors: kInput (models), kResource, among it that the scene needs more than
/// `limit`, which is known once the models are read. With Sharing::kNone the objects of each actor
/// stand where it does.
Result<PreparedScene> prepare_scene(const Scene& scene, Engine& engine,
                                    const std::filesystem::path& cache_folder,
                                    const MemoryLimit& limit = {}, Fits fits = Fits::kMake,
                                    Sharing sharing = Sharing::kAlike);

}  // namespace polymorph
