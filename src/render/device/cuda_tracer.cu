// The CUDA tracer: one thread a path. Compiled without contraction and with denormals flushed to
// zero, as the CPU's tiles are.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "render/device/device_tracer.h"
#include "render/device/trace_path.h"

namespace polymorph {
namespace {

constexpr int kThreads = 128;

/// Memory of the device that only grows.
class DeviceMemory {
 public:
  DeviceMemory() = default;
  DeviceMemory(const DeviceMemory&) = delete;
  DeviceMemory& operator=(const DeviceMemory&) = delete;
  ~DeviceMemory() { cudaFree(data_); }
  cudaError_t reserve(std::size_t bytes) {
    if (bytes <= size_) return cudaSuccess;
    cudaFree(data_);
    data_ = nullptr;
    size_ = 0;
    const cudaError_t error = cudaMalloc(&data_, bytes);
    if (error == cudaSuccess) size_ = bytes;
    return error;
  }
  template <class T>
  T* as() const {
    return static_cast<T*>(data_);
  }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Rows of the picture that one launch traces.
struct Band {
  int first_row = 0;
  int pixels = 0;
};

__global__ void __launch_bounds__(kThreads)
    mark_motion(const __grid_constant__ DeviceFrame frame, Band band, unsigned char* moving,
                unsigned long long* rays) {
  const int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (pixel >= band.pixels) return;
  RayStats stats;
  moving[pixel] = shows_motion(frame, pixel % frame.camera.size.width,
                               band.first_row + pixel / frame.camera.size.width, stats);
  if (stats.rays > 0) atomicAdd(rays, static_cast<unsigned long long>(stats.rays));
}

__global__ void __launch_bounds__(kThreads)
    trace_paths(const __grid_constant__ DeviceFrame frame, Band band, const unsigned char* moving,
                PathLight* lights, unsigned long long* rays) {
  const int samples = frame.end_sample - frame.first_sample;
  const std::size_t path = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  RayStats stats;
  if (path < static_cast<std::size_t>(band.pixels) * samples) {
    const int pixel = static_cast<int>(path / samples);
    const int sample = frame.first_sample + static_cast<int>(path % samples);
    lights[path] = trace_sample(frame, pixel % frame.camera.size.width,
                                band.first_row + pixel / frame.camera.size.width,
                                static_cast<std::uint32_t>(sample), moving[pixel] != 0, stats);
  }
  // One addition a warp.
  unsigned sum = static_cast<unsigned>(stats.rays);
  for (int lanes = 16; lanes > 0; lanes /= 2) sum += __shfl_down_sync(~0u, sum, lanes);
  if (threadIdx.x % 32 == 0) atomicAdd(rays, static_cast<unsigned long long>(sum));
}

__global__ void sum_blocks(int first_sample, int end_sample, Band band, int blocks,
                           const PathLight* lights, PixelSum* sums) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= band.pixels * blocks) return;
  const int pixel = i / blocks, first = first_sample + i % blocks * kSampleBlock;
  const int end = first + kSampleBlock < end_sample ? first + kSampleBlock : end_sample;
  const std::size_t samples = static_cast<std::size_t>(end_sample - first_sample);
  sums[i] = sum_block(lights + pixel * samples + (first - first_sample), first, end);
}

std::size_t block_count(std::size_t threads) { return (threads + kThreads - 1) / kThreads; }

class CudaTracer : public DeviceTracer {
 public:
  explicit CudaTracer(int index) : index_(index) {}
  ~CudaTracer() override { cudaSetDevice(index_); }

  cudaError_t open() {
    cudaError_t error = cudaSetDevice(index_);
    // Fails where this program holds no code for the device's architecture.
    if (error == cudaSuccess)
      error = cudaMemcpyToSymbol(device_albedo_tables, &host_albedo_tables(), sizeof(AlbedoTables));
    return error;
  }

  std::string trace(const FrameJob& job, const Bvh& bvh, DeviceSums& sums,
                    RayStats& stats) override {
    DeviceFrame frame;
    bytes_.resize(pack_frame(job, bvh, nullptr, nullptr, frame));
    const DeviceBuffers buffers = size_buffers(job, bytes_.size(), max_memory_);
    if (!buffers.error.empty()) return buffers.error;
    const cudaError_t error = trace_frame(job, bvh, buffers.rows, sums, stats);
    if (error == cudaSuccess) return "";
    cudaGetLastError();  // the next frame may find memory again
    return std::string("the device fails: ") + cudaGetErrorString(error);
  }

 private:
  cudaError_t trace_frame(const FrameJob& job, const Bvh& bvh, std::size_t rows, DeviceSums& sums,
                          RayStats& stats) {
    if (const cudaError_t error = cudaSetDevice(index_)) return error;
    DeviceFrame frame;
    if (const cudaError_t error = scene_.reserve(bytes_.size())) return error;
    pack_frame(job, bvh, scene_.as<std::byte>(), bytes_.data(), frame);
    const auto width = static_cast<std::size_t>(job.image.width);
    const auto samples = static_cast<std::size_t>(frame.end_sample - frame.first_sample);
    if (const cudaError_t error = lights_.reserve(rows * width * samples * sizeof(PathLight)))
      return error;
    if (const cudaError_t error = moving_.reserve(rows * width)) return error;
    if (const cudaError_t error = rays_.reserve(sizeof(unsigned long long))) return error;
    if (const cudaError_t error = sums_.reserve(sums.sums.size() * sizeof(PixelSum))) return error;
    cudaMemcpy(scene_.as<std::byte>(), bytes_.data(), bytes_.size(), cudaMemcpyHostToDevice);
    cudaMemset(rays_.as<std::byte>(), 0, sizeof(unsigned long long));
    for (std::size_t row = 0; row < static_cast<std::size_t>(job.image.height); row += rows) {
      const std::size_t count = std::min(rows, static_cast<std::size_t>(job.image.height) - row);
      const Band band{static_cast<int>(row), static_cast<int>(count * width)};
      auto* rays = rays_.as<unsigned long long>();
      mark_motion<<<block_count(count * width), kThreads>>>(frame, band,
                                                            moving_.as<unsigned char>(), rays);
      trace_paths<<<block_count(count * width * samples), kThreads>>>(
          frame, band, moving_.as<unsigned char>(), lights_.as<PathLight>(), rays);
      const auto blocks = static_cast<std::size_t>(sums.blocks);
      sum_blocks<<<block_count(count * width * blocks), kThreads>>>(
          frame.first_sample, frame.end_sample, band, sums.blocks, lights_.as<PathLight>(),
          sums_.as<PixelSum>() + row * width * blocks);
      if (const cudaError_t error = cudaGetLastError()) return error;
    }
    unsigned long long rays = 0;
    cudaMemcpy(&rays, rays_.as<std::byte>(), sizeof rays, cudaMemcpyDeviceToHost);
    cudaMemcpy(sums.sums.data(), sums_.as<std::byte>(), sums.sums.size() * sizeof(PixelSum),
               cudaMemcpyDeviceToHost);
    stats.rays += rays;
    stats.paths += width * static_cast<std::size_t>(job.image.height) * samples;
    return cudaDeviceSynchronize();
  }

  int index_;
  std::vector<std::byte> bytes_;
  DeviceMemory scene_, lights_, moving_, rays_, sums_;
};

}  // namespace

std::unique_ptr<DeviceTracer> make_cuda_tracer(int index, std::string& error) {
  auto tracer = std::make_unique<CudaTracer>(index);
  const cudaError_t failure = tracer->open();
  if (failure == cudaSuccess) return tracer;
  error = cudaGetErrorString(failure);
  return nullptr;
}

}  // namespace polymorph
