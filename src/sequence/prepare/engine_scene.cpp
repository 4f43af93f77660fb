#include "sequence/prepare/engine_scene.h"

#include "base/log.h"
#include "device/device.h"

namespace polymorph {

Result<EngineScene> prepare_on_engine(const Scene& scene, const Resources& resources,
                                      std::size_t pictures, Sharing sharing) {
  EngineScene result;
  result.max_memory = resources.max_memory;
  PM_TRY(result.engine, make_engine(resources.device, result.device, resources.max_memory));
  PM_TRY(result.prepared,
         prepare_scene(
             scene, *result.engine,
             {resources.cache_folder, {resources.max_memory, pictures}, Fits::kMake, sharing}));
  for (const std::string& warning : result.prepared.warnings) log_warning("{}", warning);
  return result;
}

}  // namespace polymorph
