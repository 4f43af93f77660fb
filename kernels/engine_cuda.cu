// The CUDA backend's engine, and the list of devices. The passes are instantiated in cuda_*.cu,
// which compile side by side.
#include <cstdlib>
#include <fstream>
#include <utility>

#include "backend_engine.h"
#include "cuda_backend.cuh"
#include "devices.h"
#include "motion_passes.h"

namespace polymorph {
namespace {

std::string version_text(int version) {
  return "CUDA " + std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

/// Reads the kernel module's version, such as 580.65.06, which the CUDA API does not report. Empty
/// if unknown.
std::string kernel_module_version() {
  std::ifstream file("/proc/driver/nvidia/version");
  std::string word;
  while (file >> word) {
    if (word.find_first_not_of("0123456789.") == std::string::npos &&
        word.find('.') != std::string::npos) {
      return word;
    }
  }
  return "";
}

std::string driver_text() {
  int version = 0;
  if (cudaDriverGetVersion(&version) != cudaSuccess || version == 0) {
    return "no cuda driver answers (is the NVIDIA driver installed and loaded?)";
  }
  const std::string module = kernel_module_version();
  return module.empty() ? version_text(version) : module;
}

EngineStatus no_device(std::string why) { return {EngineCode::kNoDevice, std::move(why)}; }

/// Explains why cudaGetDeviceCount() found no device.
std::string explain_no_device(cudaError_t error) {
  int driver = 0, runtime = 0;
  if (cudaDriverGetVersion(&driver) != cudaSuccess || driver == 0) {
    return "no NVIDIA driver answers (is it installed and loaded?)";
  }
  if (error == cudaErrorInsufficientDriver && cudaRuntimeGetVersion(&runtime) == cudaSuccess) {
    return "the NVIDIA driver (" + version_text(driver) + ") is too old for this build (" +
           version_text(runtime) + "), update it";
  }
  const char* visible = std::getenv("CUDA_VISIBLE_DEVICES");
  if (visible && (error == cudaSuccess || error == cudaErrorNoDevice)) {
    return "CUDA_VISIBLE_DEVICES=\"" + std::string(visible) + "\" hides every GPU";
  }
  if (error == cudaSuccess || error == cudaErrorNoDevice) {
    return "the NVIDIA driver (" + version_text(driver) + ") sees no GPU";
  }
  return std::string("the NVIDIA driver fails: ") + cudaGetErrorString(error);
}

}  // namespace

std::unique_ptr<Engine> make_cuda_engine(int index, EngineStatus& status) {
  int count = 0;
  cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess || count == 0) {
    status = no_device(explain_no_device(error));
    return nullptr;
  }
  if (index < 0 || index >= count) {
    status = no_device("there is no cuda device " + std::to_string(index) +
                       " (this machine has 0 to " + std::to_string(count - 1) + ")");
    return nullptr;
  }
  try {
    CudaBackend backend(index);
    // The next call fails if this program has no code for the device's architecture.
    cudaFuncAttributes attributes;
    error = cudaFuncGetAttributes(&attributes, run_items<MoveBalls>);
    if (error != cudaSuccess) {
      status = no_device("cuda device " + std::to_string(index) + " cannot run this build (" +
                         cudaGetErrorString(error) + ")");
      return nullptr;
    }
    status = {};
    return std::make_unique<BackendEngine<CudaBackend>>(std::move(backend));
  } catch (const EngineFailure& failure) {
    status = failure.status;
    return nullptr;
  }
}

DeviceList list_cuda_devices() {
  DeviceList out;
  out.built_with_cuda = true;
  int version = 0;
  if (cudaRuntimeGetVersion(&version) == cudaSuccess) out.runtime = version_text(version);
  out.driver = driver_text();
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess) {
    out.driver += std::string(": ") + cudaGetErrorString(error);
    return out;
  }
  for (int i = 0; i < count; ++i) {
    cudaDeviceProp properties;
    if (cudaGetDeviceProperties(&properties, i) != cudaSuccess) continue;
    out.devices.push_back(
        {i, properties.name, properties.totalGlobalMem,
         std::to_string(properties.major) + "." + std::to_string(properties.minor)});
  }
  return out;
}

}  // namespace polymorph
