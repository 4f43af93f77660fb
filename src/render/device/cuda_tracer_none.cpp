// Stub of make_cuda_tracer() for builds without CUDA, or with an nvcc older than 12.
#if !defined(PM_HAVE_CUDA)
#include "render/device/device_tracer.h"

namespace polymorph {

std::unique_ptr<DeviceTracer> make_cuda_tracer(int, std::string& error) {
  error = "this polymorph was built without CUDA 12 or later";
  return nullptr;
}

}  // namespace polymorph
#endif
