// CUDA devices of this machine.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace polymorph {

struct DeviceInfo {
  int index = 0;
  std::string name;
  std::size_t memory_bytes = 0;
  std::string capability;  ///< compute capability, MAJOR.MINOR
};

/// The devices that `polymorph devices` lists. If `built_with_cuda` is false, this program has no
/// CUDA code.
struct DeviceList {
  bool built_with_cuda = false;
  std::string runtime;  ///< "CUDA MAJOR.MINOR"; empty in a build without CUDA
  std::string driver;   ///< version of the kernel module or of CUDA, or why no driver answers
  std::vector<DeviceInfo> devices;
};
DeviceList list_cuda_devices();

}  // namespace polymorph
