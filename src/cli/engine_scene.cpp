#include "cli/engine_scene.h"

#include "base/log.h"
#include "device/device.h"

namespace polymorph {

Result<EngineScene> prepare_on_engine(const CommandLine& line, const Scene& scene,
                                      std::size_t pictures, Sharing sharing) {
  EngineScene result;
  PM_TRY(result.engine, make_engine(line.common.device, result.device, line.common.max_memory));
  PM_TRY(result.prepared, prepare_scene(scene, *result.engine, cache_folder(line.common),
                                        {line.common.max_memory, pictures}, Fits::kMake, sharing));
  for (const std::string& warning : result.prepared.warnings) log_warning("{}", warning);
  return result;
}

}  // namespace polymorph
