// Scene preparation on a device, with the engine that makes the scene's surfaces.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "base/result.h"
#include "kernels/engine.h"
#include "sequence/prepare/prepare.h"

namespace polymorph {

/// Device, cache and memory that a command works with.
struct Resources {
  std::string device = "auto";         ///< a device as in make_engine()
  std::filesystem::path cache_folder;  ///< empty: no cache
  std::size_t max_memory = 0;          ///< bytes; 0: no limit
};

/// A prepared scene, and the engine that makes its surfaces.
struct EngineScene {
  std::unique_ptr<Engine> engine;
  std::string device;          ///< name of the engine's device
  std::size_t max_memory = 0;  ///< bytes; 0: no limit
  PreparedScene prepared;
};

/// Prepares a scene on a device, and logs its warnings. `pictures`: number of rendered frames that
/// will be in memory at a time. Errors: those of make_engine() and prepare_scene().
Result<EngineScene> prepare_on_engine(const Scene& scene, const Resources& resources,
                                      std::size_t pictures = 0, Sharing sharing = Sharing::kAlike);

}  // namespace polymorph
