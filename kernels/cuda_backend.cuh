// The CUDA side of the three things a backend is: for_each, exclusive_scan, Buffer. One stream a
// backend; every call and every launch is checked with its own return value.
#pragma once

#include <cuda_runtime.h>
#include <nvtx3/nvToolsExt.h>

#include <cstdint>
#include <cub/device/device_scan.cuh>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "extract_surface.h"
#include "validate.h"
#include "view.h"

namespace polymorph {

inline ExtractStatus cuda_status(cudaError_t error, const char* doing) {
  const std::string text =
      std::string(cudaGetErrorString(error)) + " (" + cudaGetErrorName(error) + ")";
  if (error == cudaErrorMemoryAllocation) {
    return {ExtractCode::kOutOfMemory,
            std::string("the cuda device has no memory left while doing '") + doing + "': " + text +
                ", use a coarser grid or the cpu backend"};
  }
  return {ExtractCode::kDeviceError, std::string("the cuda device failed while doing '") + doing +
                                         "': " + text + ", try again or use the cpu backend"};
}

inline void check_cuda(cudaError_t error, const char* doing) {
  if (error != cudaSuccess) throw ExtractFailure{cuda_status(error, doing)};
}

/// Grid-stride loop: any n, any number of blocks.
template <class F>
__global__ void run_items(std::int64_t n, F f) {
  const std::int64_t stride = static_cast<std::int64_t>(gridDim.x) * blockDim.x;
  for (std::int64_t i = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x; i < n;
       i += stride) {
    f(i);
  }
}

template <class Offset>
struct AddOffsets {
  __host__ __device__ Offset operator()(Offset a, Offset b) const { return a + b; }
};

class CudaBackend {
 public:
  /// A warp shares a ball list already, so a thread takes one point.
  static constexpr int kLanes = 1;

  explicit CudaBackend(int device) : device_(device) {
    check_cuda(cudaSetDevice(device_), "select the device");
    check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "create a stream");
  }
  CudaBackend(CudaBackend&& other) noexcept
      : device_(other.device_),
        stream_(std::exchange(other.stream_, nullptr)),
        scratch_(std::exchange(other.scratch_, nullptr)),
        scratch_bytes_(std::exchange(other.scratch_bytes_, 0)),
        spans_(std::move(other.spans_)),
        used_spans_(std::exchange(other.used_spans_, 0)),
        times_(std::move(other.times_)) {}
  CudaBackend(const CudaBackend&) = delete;
  CudaBackend& operator=(const CudaBackend&) = delete;
  CudaBackend& operator=(CudaBackend&&) = delete;
  ~CudaBackend() {
    // Nothing can be done about a failing release; a dead device also reports its first error here
    // again.
    for (const Span& span : spans_) {
      (void)cudaEventDestroy(span.begin);
      (void)cudaEventDestroy(span.end);
    }
    (void)cudaFree(scratch_);
    if (stream_ != nullptr) (void)cudaStreamDestroy(stream_);
  }

  /// Uninitialised device memory that only grows; contents are lost on growth.
  template <class T>
  class Buffer {
   public:
    Buffer() = default;
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    ~Buffer() { (void)cudaFree(data_); }

    View<T> resize(CudaBackend& backend, std::int64_t n) {
      if (n > capacity_) {
        // Passes already launched may still use the old memory; cudaFree waits for them.
        check_cuda(cudaFree(std::exchange(data_, nullptr)), "free a buffer");
        capacity_ = 0;
        const std::int64_t wanted = n + n / 4;
        void* memory = backend.allocate(static_cast<std::size_t>(wanted) * sizeof(T));
        data_ = static_cast<T*>(memory);
        capacity_ = wanted;
      }
      return {data_, n};
    }

   private:
    T* data_ = nullptr;
    std::int64_t capacity_ = 0;
  };

  template <class F>
  void for_each(std::int64_t n, const F& f, const char* name) {
    static_assert(std::is_trivially_copyable<F>::value,
                  "a kernel is copied to the device as bytes");
    if (n <= 0) return;
    const Scope scope(*this, name);
    constexpr std::int64_t kThreads = 128, kMostBlocks = std::int64_t{1} << 20;
    const std::int64_t wanted = (n + kThreads - 1) / kThreads;
    const auto blocks = static_cast<unsigned>(wanted < kMostBlocks ? wanted : kMostBlocks);
    run_items<<<blocks, static_cast<unsigned>(kThreads), 0, stream_>>>(n, f);
    check_cuda(cudaGetLastError(), name);
  }

  /// offsets[i] = counts[0] + ... + counts[i - 1]; offsets has one element more than counts, the
  /// total.
  template <class Count, class Offset>
  void exclusive_scan(View<Count> counts, View<Offset> offsets, const char* name) {
    const Scope scope(*this, name);
    check_cuda(cudaMemsetAsync(offsets.data, 0, sizeof(Offset), stream_), name);
    if (counts.size == 0) return;
    std::size_t bytes = 0;
    const auto scan = [&](void* scratch) {
      return cub::DeviceScan::InclusiveScanInit(scratch, bytes, counts.data, offsets.data + 1,
                                                AddOffsets<Offset>{}, Offset{0}, counts.size,
                                                stream_);
    };
    check_cuda(scan(nullptr), name);
    if (bytes > scratch_bytes_) {
      check_cuda(cudaFree(std::exchange(scratch_, nullptr)), name);
      scratch_bytes_ = 0;
      scratch_ = allocate(bytes + bytes / 4);
      scratch_bytes_ = bytes + bytes / 4;
    }
    check_cuda(scan(scratch_), name);
  }

  template <class T>
  void upload(View<T> to, const T* from) {
    const auto bytes = static_cast<std::size_t>(to.size) * sizeof(T);
    check_cuda(cudaMemcpyAsync(to.data, from, bytes, cudaMemcpyHostToDevice, stream_), "upload");
    // The caller's memory may go away as soon as this returns.
    check_cuda(cudaStreamSynchronize(stream_), "upload");
  }
  template <class T>
  void download(T* to, View<T> from) {
    const auto bytes = static_cast<std::size_t>(from.size) * sizeof(T);
    check_cuda(cudaMemcpyAsync(to, from.data, bytes, cudaMemcpyDeviceToHost, stream_), "download");
    check_cuda(cudaStreamSynchronize(stream_), "download");
  }
  template <class T>
  void fill_zero(View<T> to) {
    check_cuda(cudaMemsetAsync(to.data, 0, static_cast<std::size_t>(to.size) * sizeof(T), stream_),
               "clear");
  }

  void start_frame() {
    check_cuda(cudaSetDevice(device_), "select the device");
    used_spans_ = 0;
    times_.clear();
  }
  void finish_frame() {
    check_cuda(cudaStreamSynchronize(stream_), "finish the frame");
    for (std::size_t i = 0; i < used_spans_; ++i) {
      float milliseconds = 0;
      check_cuda(cudaEventElapsedTime(&milliseconds, spans_[i].begin, spans_[i].end),
                 "read the timers");
      add_pass_time(times_, spans_[i].name, 1e-3 * static_cast<double>(milliseconds));
    }
  }
  std::vector<PassTime> pass_times() const { return times_; }

 private:
  /// Device time of one call, between two events.
  struct Span {
    const char* name;
    cudaEvent_t begin, end;
  };

  /// Marks a call for the profiler and for pass_times().
  class Scope {
   public:
    Scope(CudaBackend& backend, const char* name)
        : backend_(backend), index_(backend.next_span(name)) {
      (void)nvtxRangePushA(name);
      check_cuda(cudaEventRecord(backend.spans_[index_].begin, backend.stream_), name);
    }
    ~Scope() {
      // A failure here shows in the next checked call on this stream.
      (void)cudaEventRecord(backend_.spans_[index_].end, backend_.stream_);
      (void)nvtxRangePop();
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    CudaBackend& backend_;
    std::size_t index_;
  };

  std::size_t next_span(const char* name) {
    if (used_spans_ == spans_.size()) {
      Span span = {name, nullptr, nullptr};
      check_cuda(cudaEventCreate(&span.begin), "create a timer");
      check_cuda(cudaEventCreate(&span.end), "create a timer");
      spans_.push_back(span);
    }
    spans_[used_spans_].name = name;
    return used_spans_++;
  }

  void* allocate(std::size_t bytes) {
    void* memory = nullptr;
    const cudaError_t error = cudaMalloc(&memory, bytes);
    if (error == cudaErrorMemoryAllocation)
      (void)cudaGetLastError();  // not sticky: the next frame may fit
    check_cuda(error, "allocate");
    return memory;
  }

  int device_ = 0;
  cudaStream_t stream_ = nullptr;
  void* scratch_ = nullptr;
  std::size_t scratch_bytes_ = 0;
  std::vector<Span> spans_;
  std::size_t used_spans_ = 0;
  std::vector<PassTime> times_;
};

}  // namespace polymorph
