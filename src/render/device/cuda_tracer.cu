// CUDA path tracer with one thread per path. This file is compiled without contraction and with
// denormals flushed to zero, because the CPU traces in this way, too.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "base/stopwatch.h"
#include "render/device/cuda_hierarchy.cuh"
#include "render/device/cuda_memory.cuh"
#include "render/device/device_tracer.h"
#include "render/device/trace_path.h"

namespace polymorph {
namespace {

/// Minimum number of resident blocks per multiprocessor: more blocks hide the latency of memory,
/// but leave fewer registers per thread.
constexpr int kBlocks = 5;

/// Rows of the picture that one kernel launch traces.
struct Band {
  int first_row = 0;
  int pixels = 0;
};

/// Device arrays with an entry per pixel of the picture, or per pixel and node (`sums`).
struct Film {
  PixelSum* sums;
  MeshHit* centers;
  bool* done;  ///< pixels that get no more samples; null without adaptive sampling
};

/// Counters that all threads update.
struct Tally {
  unsigned long long rays = 0;
  unsigned remaining = 0;  ///< tiles with pixels that have not converged
};

/// Adds the rays of all threads to `tally`, with one atomic addition per warp.
__device__ void count_rays(const RayStats& stats, Tally* tally) {
  auto sum = static_cast<unsigned>(stats.rays);
  for (int lanes = 16; lanes > 0; lanes /= 2) sum += __shfl_down_sync(~0u, sum, lanes);
  if (threadIdx.x % 32 == 0) atomicAdd(&tally->rays, static_cast<unsigned long long>(sum));
}

__global__ void __launch_bounds__(kThreads)
    find_centers(const __grid_constant__ DeviceFrame frame, MeshHit* centers, Tally* tally) {
  const int pixel = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const int width = frame.camera.size.width;
  RayStats stats;
  if (pixel < width * frame.camera.size.height)
    centers[pixel] = find_center(frame, pixel % width, pixel / width, stats);
  count_rays(stats, tally);
}

/// Traces the samples of a band's pixels, one sample per thread: path_lights[path] has all samples
/// of the first pixel, then those of the next.
__global__ void __launch_bounds__(kThreads, kBlocks)
    trace_paths(const __grid_constant__ DeviceFrame frame, Band band, Film film,
                PathLight* path_lights, Tally* tally) {
  const int samples = frame.end_sample - frame.first_sample, width = frame.camera.size.width;
  const std::size_t path = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  RayStats stats;
  if (path < static_cast<std::size_t>(band.pixels) * samples) {
    const int pixel = band.first_row * width + static_cast<int>(path / samples);
    const int sample = frame.first_sample + static_cast<int>(path % samples);
    if (!film.done || !film.done[pixel]) {
      const MeshHit center = frame.needs_motion_test ? film.centers[pixel] : MeshHit{};
      path_lights[path] =
          trace_sample(frame, pixel % width, pixel / width, static_cast<std::uint32_t>(sample),
                       shows_motion(frame, center), stats);
    }
  }
  count_rays(stats, tally);
}

/// Sums the light of each pixel's samples into its nodes.
__global__ void __launch_bounds__(kThreads)
    sum_pixels(int first_sample, int end_sample, int width, Band band, int node_count, Film film,
               const PathLight* path_lights) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= band.pixels) return;
  const int pixel = band.first_row * width + i;
  if (film.done && film.done[pixel]) return;
  const auto samples = static_cast<std::size_t>(end_sample - first_sample);
  sum_samples(path_lights + i * samples, first_sample, end_sample, film.done && first_sample > 0,
              film.sums + static_cast<std::size_t>(pixel) * node_count);
}

/// Marks converged pixels, one tile per thread, and counts the tiles with other pixels.
__global__ void __launch_bounds__(kThreads)
    mark_tiles(const __grid_constant__ DeviceFrame frame, Film film, Tally* tally) {
  const int tile = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (tile < count_tiles(frame) && mark_tile(frame, tile, film.sums, film.done))
    atomicAdd(&tally->remaining, 1u);
}

__global__ void __launch_bounds__(kThreads)
    find_ray_hits(const __grid_constant__ DeviceScene scene, const Ray* rays, int count, bool bare,
                  MeshHit* hits) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < count) hits[i] = bare ? scene.closest_in_floats(rays[i]) : scene.closest(rays[i]);
}

class CudaTracer : public DeviceTracer {
 public:
  explicit CudaTracer(int index) : index_(index) {}
  ~CudaTracer() override {
    cudaSetDevice(index_);
    if (finished_) cudaEventDestroy(finished_);
    if (stream_) cudaStreamDestroy(stream_);
  }

  cudaError_t open() {
    cudaError_t error = cudaSetDevice(index_);
    // This fails if the program has no code for the device's architecture.
    if (error == cudaSuccess)
      error = cudaMemcpyToSymbol(device_albedo_tables, &host_albedo_tables(), sizeof(AlbedoTables));
    if (error == cudaSuccess) error = cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking);
    if (error == cudaSuccess)
      error = cudaEventCreateWithFlags(&finished_, cudaEventBlockingSync | cudaEventDisableTiming);
    return error;
  }

  std::string trace(const FrameJob& job, DeviceFilm& film, RayStats& stats) override {
    DeviceFrame frame;
    const std::size_t bytes = pack_frame(job, nullptr, nullptr, frame);
    const DeviceBuffers buffers = size_buffers(job, frame, bytes, max_memory_);
    if (!buffers.error.empty()) return buffers.error;
    return describe(trace_frame(job, bytes, buffers, film, stats));
  }
  std::string find_hits(const FrameJob& job, std::span<const Ray> rays, bool bare,
                        std::span<MeshHit> hits, double& seconds) override {
    return describe(run_ray_queries(job, rays, bare, hits, seconds));
  }

 private:
  static std::string describe(cudaError_t error) {
    if (error == cudaSuccess) return "";
    cudaGetLastError();  // clears the error, because memory may suffice for the next frame
    return std::string("the device fails: ") + cudaGetErrorString(error);
  }

  /// Copies the packed frame to the device, and builds the hierarchy there.
  cudaError_t upload(const FrameJob& job, std::size_t bytes, DeviceFrame& frame) {
    if (const cudaError_t error = cudaSetDevice(index_)) return error;
    if (const cudaError_t error = scene_.reserve(bytes)) return error;
    if (const cudaError_t error = packed_.reserve(bytes)) return error;
    pack_frame(job, scene_.data(), packed_.data(), frame);
    cudaMemcpyAsync(scene_.data(), packed_.data(), bytes, cudaMemcpyHostToDevice, stream_);
    std::vector<std::size_t> triangle_counts;
    for (std::uint32_t m = 0; m < job.world.geometry->mesh_count(); ++m)
      triangle_counts.push_back(job.world.geometry->mesh(m).triangles.size());
    return hierarchy_.build(triangle_counts, stream_, frame.scene);
  }

  cudaError_t run_ray_queries(const FrameJob& job, std::span<const Ray> rays, bool bare,
                              std::span<MeshHit> hits, double& seconds) {
    DeviceFrame frame;
    if (const cudaError_t error = upload(job, pack_frame(job, nullptr, nullptr, frame), frame))
      return error;
    // The rays take the memory of the paths' light, and the hits that of the film.
    if (const cudaError_t error = path_lights_.reserve(rays.size_bytes())) return error;
    if (const cudaError_t error = film_.reserve(hits.size_bytes())) return error;
    cudaMemcpyAsync(path_lights_.data(), rays.data(), rays.size_bytes(), cudaMemcpyHostToDevice,
                    stream_);
    if (const cudaError_t error = cudaStreamSynchronize(stream_)) return error;
    const Stopwatch stopwatch;
    find_ray_hits<<<block_count(rays.size()), kThreads, 0, stream_>>>(
        frame.scene, path_lights_.as<Ray>(), static_cast<int>(rays.size()), bare,
        film_.as<MeshHit>());
    if (const cudaError_t error = cudaStreamSynchronize(stream_)) return error;
    seconds = stopwatch.seconds();
    return cudaMemcpy(hits.data(), film_.data(), hits.size_bytes(), cudaMemcpyDeviceToHost);
  }

  /// Traces a frame in rounds of samples (round_end()). With adaptive sampling, each round marks
  /// the pixels that have converged, and tracing ends when none is left.
  cudaError_t trace_frame(const FrameJob& job, std::size_t bytes, const DeviceBuffers& buffers,
                          DeviceFilm& film, RayStats& stats) {
    DeviceFrame frame;
    if (const cudaError_t error = upload(job, bytes, frame)) return error;
    const auto width = static_cast<std::size_t>(job.image.width),
               height = static_cast<std::size_t>(job.image.height),
               nodes = static_cast<std::size_t>(frame.node_count);
    const std::size_t sum_count = width * height * nodes,
                      center_count = frame.finds_centers ? width * height : 0;
    if (const cudaError_t error =
            path_lights_.reserve(buffers.rows * width * buffers.samples * sizeof(PathLight)))
      return error;
    // `film_` holds the tally, the pixels' sums, their centres and the marks of convergence, in
    // this order. All but the marks are copied back.
    const std::size_t film_size =
        kFilmStart + sum_count * sizeof(PixelSum) + center_count * sizeof(MeshHit);
    const std::size_t mark_bytes = frame.noise > 0 ? width * height * sizeof(bool) : 0;
    if (const cudaError_t error = film_.reserve(film_size + mark_bytes)) return error;
    if (const cudaError_t error = host_film_.reserve(film_size)) return error;
    auto* tally = film_.as<Tally>();
    auto* sums = reinterpret_cast<PixelSum*>(film_.data() + kFilmStart);
    const Film on_device{
        sums, reinterpret_cast<MeshHit*>(sums + sum_count),
        mark_bytes > 0 ? reinterpret_cast<bool*>(film_.data() + film_size) : nullptr};
    cudaMemsetAsync(film_.data(), 0, film_size + mark_bytes, stream_);
    if (frame.finds_centers)
      find_centers<<<block_count(width * height), kThreads, 0, stream_>>>(frame, on_device.centers,
                                                                          tally);
    for (int first = job.samples.first, end; first < job.samples.end; first = end) {
      end = round_end(frame.noise, first, job.samples.end);
      frame.first_sample = first;
      frame.end_sample = end;
      const auto samples = static_cast<std::size_t>(end - first);
      // A launch of a shorter round traces more rows.
      trace_round(frame, buffers.rows * buffers.samples / samples, on_device, tally);
      if (const cudaError_t error = cudaGetLastError()) return error;
      if (end == job.samples.end) break;
      mark_tiles<<<block_count(count_tiles(frame)), kThreads, 0, stream_>>>(frame, on_device,
                                                                            tally);
      auto& host_tally = *host_film_.as<Tally>();
      cudaMemcpyAsync(&host_tally, tally, sizeof host_tally, cudaMemcpyDeviceToHost, stream_);
      cudaMemsetAsync(&tally->remaining, 0, sizeof tally->remaining, stream_);
      if (const cudaError_t error = wait_asleep()) return error;
      if (host_tally.remaining == 0) break;
    }
    cudaMemcpyAsync(host_film_.data(), film_.data(), film_size, cudaMemcpyDeviceToHost, stream_);
    if (const cudaError_t error = wait_asleep()) return error;
    stats.rays += host_film_.as<Tally>()->rays;
    const auto* host_sums = reinterpret_cast<const PixelSum*>(host_film_.data() + kFilmStart);
    const auto samples = static_cast<std::size_t>(job.samples.count());
    stats.paths +=
        frame.noise > 0 ? sum_sample_counts({host_sums, sum_count}) : width * height * samples;
    film = {list_nodes(job.samples),
            {host_sums, sum_count},
            {reinterpret_cast<const MeshHit*>(host_sums + sum_count), center_count}};
    return cudaSuccess;
  }

  /// Waits for the stream without occupying a core, which other frames need: tracing takes
  /// milliseconds, and cudaStreamSynchronize() would poll meanwhile.
  cudaError_t wait_asleep() {
    if (const cudaError_t error = cudaEventRecord(finished_, stream_)) return error;
    return cudaEventSynchronize(finished_);
  }

  static std::uint64_t sum_sample_counts(std::span<const PixelSum> sums) {
    std::uint64_t count = 0;
    for (const PixelSum& sum : sums) count += static_cast<std::uint64_t>(sum.samples);
    return count;
  }

  /// Traces the samples of a round, `rows` rows of the picture per launch, and sums them.
  void trace_round(const DeviceFrame& frame, std::size_t rows, Film film, Tally* tally) {
    const auto width = static_cast<std::size_t>(frame.camera.size.width),
               height = static_cast<std::size_t>(frame.camera.size.height),
               samples = static_cast<std::size_t>(frame.end_sample - frame.first_sample);
    for (std::size_t row = 0; row < height; row += rows) {
      const std::size_t pixels = std::min(rows, height - row) * width;
      const Band band{static_cast<int>(row), static_cast<int>(pixels)};
      trace_paths<<<block_count(pixels * samples), kThreads, 0, stream_>>>(
          frame, band, film, path_lights_.as<PathLight>(), tally);
      sum_pixels<<<block_count(pixels), kThreads, 0, stream_>>>(
          frame.first_sample, frame.end_sample, frame.camera.size.width, band, frame.node_count,
          film, path_lights_.as<PathLight>());
    }
  }

  static constexpr std::size_t kFilmStart = 256;  ///< bytes of `film_` for the tally

  int index_;
  cudaStream_t stream_ = nullptr;
  cudaEvent_t finished_ = nullptr;  ///< recorded after the work that wait_asleep() waits for
  CudaHierarchy hierarchy_;
  DeviceMemory scene_, path_lights_, film_;
  HostMemory packed_, host_film_;
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
