// The symbols of engine_cuda.cu in a build without CUDA.
#include "devices.h"
#include "engine.h"

namespace polymorph {

std::unique_ptr<Engine> make_cuda_engine(int, EngineStatus& status) {
  status = {EngineCode::kBuiltWithoutCuda,
            "this polymorph was built without CUDA (no nvcc was found or POLYMORPH_CUDA=OFF)"};
  return nullptr;
}

DeviceList list_cuda_devices() { return {}; }

}  // namespace polymorph
