// Growing buffers in a GPU's memory and in page-locked host memory, which a GPU copies by DMA.
#pragma once

#include <cstddef>

namespace polymorph {

/// A buffer that only grows. Kind: OnDevice or OnHost.
template <class Kind>
class GrowingMemory {
 public:
  GrowingMemory() = default;
  GrowingMemory(const GrowingMemory&) = delete;
  GrowingMemory& operator=(const GrowingMemory&) = delete;
  ~GrowingMemory() { Kind::release(data_); }
  /// Makes the buffer at least this large. Its contents are lost if it grows.
  cudaError_t reserve(std::size_t bytes) {
    if (bytes <= size_) return cudaSuccess;
    Kind::release(data_);
    data_ = nullptr;
    size_ = 0;
    const cudaError_t error = Kind::allocate(&data_, bytes);
    if (error == cudaSuccess) size_ = bytes;
    return error;
  }
  std::byte* data() const { return static_cast<std::byte*>(data_); }
  std::size_t size() const { return size_; }
  template <class T>
  T* as() const {
    return static_cast<T*>(data_);
  }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

struct OnDevice {
  static cudaError_t allocate(void** data, std::size_t bytes) { return cudaMalloc(data, bytes); }
  static void release(void* data) { cudaFree(data); }
};
struct OnHost {
  static cudaError_t allocate(void** data, std::size_t bytes) {
    return cudaHostAlloc(data, bytes, cudaHostAllocDefault);
  }
  static void release(void* data) { cudaFreeHost(data); }
};
using DeviceMemory = GrowingMemory<OnDevice>;
using HostMemory = GrowingMemory<OnHost>;

}  // namespace polymorph
