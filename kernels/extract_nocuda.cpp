// The symbols of extract_cuda.cu in a build without CUDA.
#include "extract_surface.h"

namespace polymorph {

std::unique_ptr<SurfaceExtractor> make_cuda_extractor(int, ExtractStatus& status) {
  status = {ExtractCode::kBuiltWithout,
            "this polymorph was built without CUDA (no nvcc was found or POLYMORPH_CUDA=OFF)"};
  return nullptr;
}

DeviceList list_cuda_devices() { return {}; }

}  // namespace polymorph
