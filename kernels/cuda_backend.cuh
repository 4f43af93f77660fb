// The CUDA backend of the extraction passes (backend_engine.h lists what a backend offers). Each
// backend has one stream for passes and one for downloads; the return value of every call and every
// launch is checked.
#pragma once

#include <cuda_runtime.h>
#include <nvtx3/nvToolsExt.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <cub/block/block_exchange.cuh>
#include <cub/block/block_scan.cuh>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine.h"
#include "parallel_copy.h"
#include "tree.h"
#include "validate.h"
#include "view.h"

namespace polymorph {

inline EngineStatus cuda_status(cudaError_t error, const char* doing) {
  const std::string text =
      std::string(cudaGetErrorString(error)) + " (" + cudaGetErrorName(error) + ")";
  if (error == cudaErrorMemoryAllocation)
    return {EngineCode::kOutOfMemory,
            std::string("the cuda device has no memory left while doing '") + doing + "': " + text};
  return {EngineCode::kDeviceError,
          std::string("the cuda device failed while doing '") + doing + "': " + text};
}

inline void check_cuda(cudaError_t error, const char* doing) {
  if (error != cudaSuccess) throw EngineFailure{cuda_status(error, doing)};
}

/// Waits until the kernel before this one has ended. Every kernel calls this before it ends, so
/// that all earlier kernels have ended when it has. All but those beside the last pass call it
/// first, and may then read what all earlier ones wrote.
__device__ inline void wait_for_previous_kernel() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
#endif
}
/// Lets the next kernel start its blocks where there is room, once all blocks of this one have
/// called this or have ended.
__device__ inline void admit_next_kernel() {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

/// Calls f(i) for i in [0, n) in a grid-stride loop, with any number of blocks.
template <class F>
__global__ void run_items(std::int64_t n, const __grid_constant__ F f) {
  wait_for_previous_kernel();
  admit_next_kernel();
  const std::int64_t stride = static_cast<std::int64_t>(gridDim.x) * blockDim.x;
  for (std::int64_t i = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x; i < n;
       i += stride) {
    f(i);
  }
}

/// The threads of a block; a group is a warp of them.
struct CudaTeam {
  using V = float;
  static constexpr std::uint32_t kGroup = 32;
  /// Teams per node, so that each of the 16 groups of a team of ClassifyChildren has one child.
  static constexpr int kParts = 4;
  static constexpr unsigned kAll = 0xffffffffu;  ///< mask of all threads of a warp

#if defined(__CUDA_ARCH__)
  template <class F>
  __device__ void each(int n, const F& f) const {
    for (int i = static_cast<int>(threadIdx.x); i < n; i += static_cast<int>(blockDim.x)) f(i);
  }
  template <class F>
  __device__ void each_group(int n, const F& f) const {
    const int step = static_cast<int>(blockDim.x / kGroup);
    for (int i = static_cast<int>(threadIdx.x / kGroup); i < n; i += step) f(i);
  }
  __device__ void sync() const { __syncthreads(); }
  __device__ std::uint32_t group_rank() const { return threadIdx.x % kGroup; }
  __device__ bool leads_group() const { return group_rank() == 0; }
  __device__ float group_sum(float a) const {
    for (unsigned d = kGroup / 2; d > 0; d /= 2) a += __shfl_xor_sync(kAll, a, d);
    return a;
  }
  __device__ float group_max(float a) const {
    for (unsigned d = kGroup / 2; d > 0; d /= 2) a = max(a, __shfl_xor_sync(kAll, a, d));
    return a;
  }
  __device__ void add(std::uint32_t& to, std::uint32_t value) const { atomicAdd(&to, value); }
  __device__ void add(std::uint64_t& to, std::uint64_t value) const {
    atomicAdd(reinterpret_cast<unsigned long long*>(&to), value);
  }
  /// Calls write(slot) in each thread that has a bit, with consecutive slots in the order of ranks.
  template <class Write>
  __device__ void append(std::uint32_t bits, std::int64_t* cursors, const Write& write) const {
    const unsigned writers = __ballot_sync(kAll, bits != 0);
    if (bits != 0) write(cursors[0] + __popc(writers & ((1u << group_rank()) - 1)));
    cursors[0] += __popc(writers);
  }
  /// Replaces n <= 64 values by their exclusive prefix sums, followed by the total.
  __device__ std::uint32_t scan(std::uint32_t* values, int n) const {
    if (threadIdx.x < kGroup) {
      const int at = 2 * static_cast<int>(threadIdx.x);
      const std::uint32_t a = at < n ? values[at] : 0, b = at + 1 < n ? values[at + 1] : 0;
      std::uint32_t sum = a + b;
      for (unsigned d = 1; d < kGroup; d *= 2) {
        const std::uint32_t other = __shfl_up_sync(kAll, sum, d);
        if (threadIdx.x >= d) sum += other;
      }
      if (at < n) values[at] = sum - a - b;
      if (at + 1 < n) values[at + 1] = sum - b;
      if (threadIdx.x == kGroup - 1) values[n] = sum;
    }
    __syncthreads();
    return values[n];
  }
#else
  // Stubs for the host compiler, which compiles functors that call these but never runs them.
  template <class F>
  PM_HD void each(int, const F&) const {}
  template <class F>
  PM_HD void each_group(int, const F&) const {}
  PM_HD void sync() const {}
  PM_HD std::uint32_t group_rank() const { return 0; }
  PM_HD bool leads_group() const { return true; }
  PM_HD float group_sum(float a) const { return a; }
  PM_HD float group_max(float a) const { return a; }
  template <class T>
  PM_HD void add(T&, T) const {}
  template <class Write>
  PM_HD void append(std::uint32_t, std::int64_t*, const Write&) const {}
  PM_HD std::uint32_t scan(std::uint32_t*, int) const { return 0; }
#endif
};

/// The least number of a pass's teams that a multiprocessor must have room for, which limits the
/// registers of a thread: F::kMinTeams, or 0 (no limit) if there is none.
template <class F, class = void>
constexpr int kMinTeams = 0;
template <class F>
constexpr int kMinTeams<F, std::void_t<decltype(F::kMinTeams)>> = F::kMinTeams;

/// Calls f with one team (block) per item and part. There are *count items (null: `limit` items);
/// those from `limit` on do not fit into memory and are left out. f stays in constant memory, also
/// where it is indexed. `kBesideLast`: whether f neither reads what the kernel before writes, nor
/// writes what that one reads or writes. As that one admits this only after it has waited itself,
/// this may read what all kernels before it wrote.
template <class F, bool kBesideLast>
__global__ void __launch_bounds__(F::kThreads, kMinTeams<F>)
    run_teams(const std::int64_t* count, std::int64_t limit, int parts,
              const __grid_constant__ F f) {
  __shared__ typename F::Scratch scratch;
  if constexpr (!kBesideLast) wait_for_previous_kernel();
  admit_next_kernel();
  const std::int64_t n = (count != nullptr && *count < limit ? *count : limit) * parts;
  for (std::int64_t i = blockIdx.x; i < n; i += gridDim.x) {
    f(CudaTeam{}, scratch, i);
    __syncthreads();
  }
  if constexpr (kBesideLast) wait_for_previous_kernel();
}

constexpr int kScanThreads = 1024, kScanEach = 4;  ///< kScanEach: items per thread and step

/// Computes exclusive prefix sums with one block, 4096 items at a time, which is fast enough for
/// the bricks of a surface. Both sums of 4096 items are packed into one word: an item has at most
/// 4116 vertices (EmitCubes) or 64 children, so that the first sum stays below 2^25 and fits into
/// 26 bits.
template <int kThreads>
__global__ void __launch_bounds__(kThreads)
    run_scan(const Counts* counts, const std::int64_t* count, std::int64_t limit, Offsets* offsets,
             Offsets* total) {
  using Word = unsigned long long;
  using Scan = cub::BlockScan<Word, kThreads, cub::BLOCK_SCAN_WARP_SCANS>;
  constexpr int kShift = 38;  // the second sum takes the other 38 bits
  // Loads and stores are striped over the threads, to be coalesced; a thread sums adjacent words.
  using Exchange = cub::BlockExchange<Word, kThreads, kScanEach>;
  __shared__ union {
    typename Scan::TempStorage scan;
    typename Exchange::TempStorage exchange;
  } storage;
  wait_for_previous_kernel();
  admit_next_kernel();
  const std::int64_t n = *count < limit ? *count : limit;
  const auto unpacked = [](Word w) {
    return Offsets{static_cast<std::int64_t>(w >> kShift),
                   static_cast<std::int64_t>(w & ((Word{1} << kShift) - 1))};
  };
  Offsets before;
  for (std::int64_t start = 0; start < n; start += kThreads * kScanEach) {
    Word words[kScanEach], sum = 0;
    const std::int64_t at = start + threadIdx.x;
    for (int k = 0; k < kScanEach; ++k) {
      const Counts c = at + k * kThreads < n ? counts[at + k * kThreads] : Counts{};
      words[k] = static_cast<Word>(c.a) << kShift | c.b;
    }
    Exchange(storage.exchange).StripedToBlocked(words, words);
    __syncthreads();
    Scan(storage.scan).ExclusiveSum(words, words, sum);
    __syncthreads();
    Exchange(storage.exchange).BlockedToStriped(words, words);
    for (int k = 0; k < kScanEach; ++k) {
      if (at + k * kThreads < n) offsets[at + k * kThreads] = before + unpacked(words[k]);
    }
    before = before + unpacked(sum);
    __syncthreads();
  }
  if (threadIdx.x == 0) *total = before;
}

class CudaBackend {
 public:
  using Team = CudaTeam;

  explicit CudaBackend(int device) : device_(device) {
    check_cuda(cudaSetDevice(device_), "select the device");
    // Passes are short, while another stream of the device may trace paths for 20 ms. With the
    // highest priority, blocks of the passes start as soon as a block of the path tracer ends.
    int lowest = 0, highest = 0;
    check_cuda(cudaDeviceGetStreamPriorityRange(&lowest, &highest), "ask for priorities");
    for (cudaStream_t* stream : {&stream_, &copy_stream_}) {
      check_cuda(cudaStreamCreateWithPriority(stream, cudaStreamNonBlocking, highest),
                 "create a stream");
    }
    check_cuda(cudaDeviceGetAttribute(&processors_, cudaDevAttrMultiProcessorCount, device_),
               "ask for the multiprocessors");
    check_cuda(cudaMallocHost(&staging_, 2 * kStagingBytes), "allocate pinned memory");
    for (cudaEvent_t& event : arrived_)
      check_cuda(cudaEventCreateWithFlags(&event, cudaEventDisableTiming), "create an event");
    for (cudaEvent_t& event : written_)
      check_cuda(cudaEventCreateWithFlags(&event, cudaEventDisableTiming), "create an event");
    overlaps_kernels_ = can_overlap_kernels();
  }
  CudaBackend(CudaBackend&& other) noexcept
      : device_(other.device_),
        processors_(other.processors_),
        overlaps_kernels_(other.overlaps_kernels_),
        stream_(std::exchange(other.stream_, nullptr)),
        copy_stream_(std::exchange(other.copy_stream_, nullptr)),
        staging_(std::exchange(other.staging_, nullptr)),
        arrived_(std::exchange(other.arrived_, {})),
        written_(std::exchange(other.written_, {})),
        marks_(std::move(other.marks_)),
        used_marks_(std::exchange(other.used_marks_, 0)) {}
  CudaBackend(const CudaBackend&) = delete;
  CudaBackend& operator=(const CudaBackend&) = delete;
  CudaBackend& operator=(CudaBackend&&) = delete;
  ~CudaBackend() {
    // A failing release cannot be handled; a dead device reports its first error here again, too.
    for (const Mark& mark : marks_) (void)cudaEventDestroy(mark.event);
    for (cudaEvent_t event : arrived_)
      if (event != nullptr) (void)cudaEventDestroy(event);
    for (cudaEvent_t event : written_)
      if (event != nullptr) (void)cudaEventDestroy(event);
    if (staging_ != nullptr) (void)cudaFreeHost(staging_);
    if (copy_stream_ != nullptr) (void)cudaStreamDestroy(copy_stream_);
    if (stream_ != nullptr) (void)cudaStreamDestroy(stream_);
  }

  /// A buffer that everything_fitted() can enlarge.
  class Growing {
   public:
    virtual void grow(CudaBackend& backend, std::int64_t n) = 0;

   protected:
    ~Growing() = default;
  };

  /// Uninitialised device memory that only grows; contents are lost on growth.
  template <class T>
  class Buffer final : public Growing {
   public:
    Buffer() = default;
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    ~Buffer() { (void)cudaFree(data_); }

    View<T> resize(CudaBackend& backend, std::int64_t n) {
      if (n > capacity_) grow(backend, n);
      return {data_, n};
    }
    /// Returns the present memory or, on the first call, memory for `guess` items of `per_item`
    /// elements each, because the host does not know *count yet. everything_fitted() enlarges the
    /// buffer if *count items do not fit.
    View<T> fit(CudaBackend& backend, const std::int64_t* count, std::int64_t per_item,
                std::int64_t guess) {
      if (capacity_ == 0) grow(backend, guess * per_item);
      backend.fits_.push_back({count, per_item, capacity_ / per_item, this});
      return {data_, capacity_ / per_item * per_item};
    }

    void grow(CudaBackend& backend, std::int64_t n) override {
      if (n <= capacity_) return;
      // Passes already launched may still use the old memory; cudaFree waits for them.
      check_cuda(cudaFree(std::exchange(data_, nullptr)), "free a buffer");
      backend.used_ -= static_cast<std::size_t>(capacity_) * sizeof(T);
      capacity_ = 0;
      const std::int64_t capacity = n + n / 4;
      data_ = static_cast<T*>(backend.allocate(static_cast<std::size_t>(capacity) * sizeof(T)));
      capacity_ = capacity;
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
    constexpr std::int64_t kThreads = 128, kMaxBlocks = std::int64_t{1} << 20;
    const std::int64_t needed = (n + kThreads - 1) / kThreads;
    const auto blocks = static_cast<unsigned>(needed < kMaxBlocks ? needed : kMaxBlocks);
    launch(run_items<F>, blocks, static_cast<unsigned>(kThreads), name, n, f);
  }

  /// Chunks of the pinned memory for downloads, and pieces of a chunk.
  static constexpr std::size_t kChunks = 8, kPieces = 16;
  static constexpr bool kHostMemory = false;  ///< whether passes work in the host's memory
  static constexpr bool kManyRoots = true;    ///< whether a tree has many roots, not one

  /// Calls f(team, scratch, i) for i in [0, n * parts), n = *count but at most `limit`; *count is
  /// read on the device. Null stands for `limit`. `kBesideLast`: whether f may run beside the last
  /// pass, since it neither reads what that writes, nor writes what that reads or writes.
  template <bool kBesideLast = false, class F>
  void for_teams(const std::int64_t* count, std::int64_t limit, const F& f, const char* name,
                 int parts = 1) {
    static_assert(std::is_trivially_copyable<F>::value,
                  "a kernel is copied to the device as bytes");
    if (limit <= 0) return;
    const Scope scope(*this, name);
    // Twice as many blocks as run at once (2048 threads per multiprocessor), because some blocks
    // take longer than others.
    const std::int64_t max_blocks = std::int64_t{4096} / F::kThreads * processors_;
    const auto blocks =
        static_cast<unsigned>(limit * parts < max_blocks ? limit * parts : max_blocks);
    launch(run_teams<F, kBesideLast>, blocks, static_cast<unsigned>(F::kThreads), name, count,
           limit, parts, f);
  }
  /// Calls f(team, scratch, i) for i in [0, n).
  template <class F>
  void for_teams(std::int64_t n, const F& f, const char* name) {
    for_teams(nullptr, n, f, name);
  }

  /// Sets offsets[i] = counts[0] + ... + counts[i - 1] for i < *n, and *total to the sum of all.
  void scan(View<const Counts> counts, const std::int64_t* n, View<Offsets> offsets, Offsets* total,
            const char* name) {
    const Scope scope(*this, name);
    launch(run_scan<kScanThreads>, 1, kScanThreads, name, counts.data, n, counts.size, offsets.data,
           total);
  }

  /// Uploads through pinned memory in chunks: while one is transferred, all host threads copy the
  /// next one. Waits for the passes only if a frame uploads more than the pinned memory holds.
  template <class T>
  void upload(View<T> to, const T* from) {
    const auto bytes = static_cast<std::size_t>(to.size) * sizeof(T);
    const auto* source = reinterpret_cast<const char*>(from);
    auto* target = reinterpret_cast<char*>(to.data);
    for (std::size_t done = 0; done < bytes;) {
      if (staged_bytes_ == kStagingBytes) {
        check_cuda(cudaStreamSynchronize(stream_), "upload");
        staged_bytes_ = 0;
      }
      const std::size_t size = std::min({bytes - done, kChunkBytes, kStagingBytes - staged_bytes_});
      char* pinned = staging_ + kStagingBytes + staged_bytes_;
      parallel_copy(pinned, source + done, size);
      check_cuda(cudaMemcpyAsync(target + done, pinned, size, cudaMemcpyHostToDevice, stream_),
                 "upload");
      staged_bytes_ += (size + 63) / 64 * 64;  // keeps chunks aligned to 64 bytes
      done += size;
    }
  }
  /// Downloads through pinned memory; returns when everything has arrived.
  template <class T>
  void download(T* to, View<T> from) {
    const Scope scope(*this, "download");
    written(Written::kMesh);
    downloads_.push_back({reinterpret_cast<char*>(to), reinterpret_cast<const char*>(from.data),
                          static_cast<std::size_t>(from.size) * sizeof(T), Written::kMesh});
    finish_downloads();
  }
  /// Returns the memory into which a pass writes *count elements of a result: device memory, from
  /// which queue_download() copies.
  template <class T>
  View<T> output(std::vector<T>&, Buffer<T>& buffer, const std::int64_t* count,
                 std::int64_t guess) {
    return buffer.fit(*this, count, 1, guess);
  }
  /// Notes that all passes that write a part of the mesh have been launched.
  void written(Written part) {
    check_cuda(cudaEventRecord(written_[static_cast<std::size_t>(part)], stream_), "download");
  }
  /// Resizes a result to n elements, which finish_frame() downloads with those of other results.
  /// `part`: what must have been written before.
  template <class T>
  void queue_download(std::vector<T>& to, View<T> from, std::int64_t n, Written part) {
    to.resize(static_cast<std::size_t>(n));
    downloads_.push_back({reinterpret_cast<char*>(to.data()),
                          reinterpret_cast<const char*>(from.data),
                          static_cast<std::size_t>(n) * sizeof(T), part});
  }

  /// `time_passes`: whether pass_times() will be asked. Measuring keeps each pass from starting
  /// before the one before it has ended.
  void start_frame(std::size_t max_memory, bool time_passes) {
    check_cuda(cudaSetDevice(device_), "select the device");
    // A frame that failed may have left copies that still use the pinned memory.
    if (std::exchange(is_in_frame_, true)) {
      check_cuda(cudaStreamSynchronize(stream_), "end the frame that failed");
      check_cuda(cudaStreamSynchronize(copy_stream_), "end the frame that failed");
    }
    times_passes_ = time_passes;
    used_marks_ = 0;
    fits_.clear();
    downloads_.clear();
    staged_bytes_ = 0;
    max_memory_ = max_memory;
  }

  /// Begins to copy the totals to the host, when the passes that count have been launched.
  /// `beside_passes`: whether other passes follow, which the copy must not wait for.
  void fetch_totals(View<Offsets> totals, bool beside_passes) {
    const auto bytes = static_cast<std::size_t>(totals.size) * sizeof(Offsets);
    totals_stream_ = beside_passes ? copy_stream_ : stream_;
    if (beside_passes) {
      check_cuda(cudaEventRecord(arrived_[0], stream_), "fetch the counts");
      check_cuda(cudaStreamWaitEvent(copy_stream_, arrived_[0]), "fetch the counts");
    }
    check_cuda(
        cudaMemcpyAsync(staging_, totals.data, bytes, cudaMemcpyDeviceToHost, totals_stream_),
        "fetch the counts");
  }
  /// Waits for the totals, but not for passes launched after fetch_totals(), and enlarges every
  /// buffer whose count exceeds its capacity. Returns true if there was none. `totals` holds all
  /// counts that were given to fit(); it is copied to `known`.
  bool everything_fitted(View<Offsets> totals, Offsets* known) {
    mark(kNoPass);
    check_cuda(cudaStreamSynchronize(totals_stream_), "fetch the counts");
    std::memcpy(known, staging_, static_cast<std::size_t>(totals.size) * sizeof(Offsets));
    bool fitted = true;
    for (const Fit& fit : fits_) {
      const std::int64_t index = fit.count - &totals.data->a;
      const Offsets& pair = known[index / 2];
      const std::int64_t count = index % 2 == 0 ? pair.a : pair.b;
      if (count <= fit.capacity) continue;
      fit.buffer->grow(*this, count * fit.per_item);
      fitted = false;
    }
    fits_.clear();
    return fitted;
  }
  std::size_t memory_used() const { return used_; }

  void finish_frame() {
    if (!downloads_.empty()) {
      const Scope scope(*this, "download");
      finish_downloads();
    }
    if (used_marks_ > 0 && std::strcmp(marks_[used_marks_ - 1].name, kNoPass) != 0) mark(kNoPass);
    check_cuda(cudaStreamSynchronize(stream_), "finish the frame");
    is_in_frame_ = false;
  }
  /// Returns the times of the last frame; only this call reads them from the device.
  std::vector<PassTime> pass_times() const {
    std::vector<PassTime> times;
    for (std::size_t i = 0; i + 1 < used_marks_; ++i) {
      float milliseconds = 0;
      if (std::strcmp(marks_[i].name, kNoPass) == 0 ||
          cudaEventElapsedTime(&milliseconds, marks_[i].event, marks_[i + 1].event) !=
              cudaSuccess) {
        continue;
      }
      add_pass_time(times, marks_[i].name, 1e-3 * static_cast<double>(milliseconds));
    }
    return times;
  }

 private:
  /// Tests whether the device and this program's code for it have what wait_for_previous_kernel()
  /// needs.
  bool can_overlap_kernels() const {
    int major = 0;
    cudaFuncAttributes code = {};
    check_cuda(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device_),
               "ask for the architecture");
    if (cudaFuncGetAttributes(&code, run_scan<kScanThreads>) != cudaSuccess) {
      (void)cudaGetLastError();  // the program has no code for this device (make_cuda_engine())
      return false;
    }
    return major >= 9 && code.ptxVersion >= 90;
  }
  /// Launches a kernel on the stream. If possible, its blocks start while the last ones of the
  /// kernel before it run, which saves most of the time between two kernels.
  template <class... Parameters, class... Arguments>
  void launch(void (*kernel)(Parameters...), unsigned blocks, unsigned threads, const char* name,
              const Arguments&... arguments) {
    cudaLaunchAttribute overlap = {};
    overlap.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    overlap.val.programmaticStreamSerializationAllowed = 1;
    cudaLaunchConfig_t config = {};
    config.gridDim = dim3(blocks);
    config.blockDim = dim3(threads);
    config.stream = stream_;
    config.attrs = &overlap;
    config.numAttrs = overlaps_kernels_ ? 1 : 0;
    check_cuda(cudaLaunchKernelEx(&config, kernel, Parameters(arguments)...), name);
  }

  /// An event on the stream, and the pass that begins there; kNoPass where a frame ends.
  struct Mark {
    const char* name;
    cudaEvent_t event;
  };

  /// Names a call for the profiler and for pass_times(). Consecutive calls of one pass share a
  /// mark, because a mark costs about as much as a small kernel.
  class Scope {
   public:
    Scope(CudaBackend& backend, const char* name) {
      (void)nvtxRangePushA(name);
      if (backend.used_marks_ == 0 ||
          std::strcmp(backend.marks_[backend.used_marks_ - 1].name, name) != 0) {
        backend.mark(name);
      }
    }
    ~Scope() { (void)nvtxRangePop(); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
  };

  void mark(const char* name) {
    if (!times_passes_) return;
    if (used_marks_ == marks_.size()) {
      Mark mark = {name, nullptr};
      check_cuda(cudaEventCreate(&mark.event), "create a timer");
      marks_.push_back(mark);
    }
    marks_[used_marks_].name = name;
    check_cuda(cudaEventRecord(marks_[used_marks_].event, stream_), name);
    ++used_marks_;
  }

  /// Bytes to copy from the device to the host, after the passes of `part`.
  struct Download {
    char* to;
    const char* from;
    std::size_t bytes;
    Written part;
  };
  /// Copies downloads_ in chunks through a ring of pinned memory. This thread starts transfers and
  /// waits for them; other threads, which are woken once for the whole frame, copy what has arrived
  /// out of the ring.
  void finish_downloads() {
    const std::vector<Download> chunks = split_downloads();
    downloads_.clear();
    RingCopies ring(chunks, staging_);
    const auto workers = std::min<std::size_t>(
        kCopyThreads, static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
    // If anything below throws, `stop` ends the tasks, and the group's destructor waits for them.
    tbb::task_group tasks;
    const Stop stop{ring};
    std::size_t started = 0;
    int last_part = -1;
    for (std::size_t arrived = 0; arrived < chunks.size();) {
      for (; started < chunks.size() && ring.has_slot(started); ++started) {
        const Download& chunk = chunks[started];
        if (static_cast<int>(chunk.part) != last_part) {
          last_part = static_cast<int>(chunk.part);
          check_cuda(
              cudaStreamWaitEvent(copy_stream_, written_[static_cast<std::size_t>(chunk.part)]),
              "download");
        }
        check_cuda(cudaMemcpyAsync(ring.slot(started), chunk.from, chunk.bytes,
                                   cudaMemcpyDeviceToHost, copy_stream_),
                   "download");
        check_cuda(cudaEventRecord(arrived_[started % kChunks], copy_stream_), "download");
      }
      if (arrived == 0) {
        for (std::size_t i = 1; i < workers; ++i) tasks.run([&ring] { ring.copy_until_end(); });
      }
      if (arrived < started) {
        check_cuda(cudaEventSynchronize(arrived_[arrived % kChunks]), "download");
        ring.publish(++arrived);
      }
      // The ring is full: this thread helps.
      if (arrived == started) ring.copy_one();
    }
    while (ring.copy_one()) {
    }
    tasks.wait();
  }
  /// The ring of finish_downloads(): chunk i takes slot i % kChunks, and is copied in kPieces
  /// pieces, so that several threads share the last one.
  class RingCopies {
   public:
    RingCopies(const std::vector<Download>& chunks, char* memory)
        : chunks_(chunks), memory_(memory) {}
    char* slot(std::size_t chunk) const { return memory_ + chunk % kChunks * kChunkBytes; }
    /// Tests whether the chunk's slot is free, because all chunks before in it have been copied.
    bool has_slot(std::size_t chunk) const {
      return copied_[chunk % kChunks].load(std::memory_order_acquire) == chunk / kChunks * kPieces;
    }
    /// Says how many chunks have arrived.
    void publish(std::size_t arrived) { arrived_.store(arrived, std::memory_order_release); }
    /// Copies the next piece of a chunk that has arrived. Returns false if there is none.
    bool copy_one() {
      std::size_t piece = next_.load(std::memory_order_relaxed);
      do {
        if (piece / kPieces >= arrived_.load(std::memory_order_acquire)) return false;
      } while (!next_.compare_exchange_weak(piece, piece + 1));
      const std::size_t chunk = piece / kPieces, part = piece % kPieces;
      const std::size_t bytes = chunks_[chunk].bytes;
      const std::size_t begin = bytes * part / kPieces, end = bytes * (part + 1) / kPieces;
      std::memcpy(chunks_[chunk].to + begin, slot(chunk) + begin, end - begin);
      copied_[chunk % kChunks].fetch_add(1, std::memory_order_release);
      return true;
    }
    /// Copies until all chunks are copied or stop() is called.
    void copy_until_end() {
      while (!stopped_.load(std::memory_order_relaxed) &&
             next_.load(std::memory_order_relaxed) < kPieces * chunks_.size()) {
        if (!copy_one()) std::this_thread::yield();
      }
    }
    void stop() { stopped_ = true; }

   private:
    const std::vector<Download>& chunks_;
    char* memory_;
    std::atomic<std::size_t> arrived_ = 0, next_ = 0;            ///< chunks; pieces
    std::array<std::atomic<std::size_t>, kChunks> copied_ = {};  ///< pieces, per slot
    std::atomic<bool> stopped_ = false;
  };
  struct Stop {
    RingCopies& ring;
    ~Stop() { ring.stop(); }
  };
  /// Splits downloads_ into chunks, and small ones into small chunks, so that copying begins early.
  std::vector<Download> split_downloads() const {
    std::size_t total = 0;
    for (const Download& download : downloads_) total += download.bytes;
    const std::size_t size = std::clamp(total / 6 / 64 * 64, kChunkBytes / 8, kChunkBytes);
    std::vector<Download> chunks;
    for (Download remaining : downloads_) {
      while (remaining.bytes > 0) {
        const std::size_t bytes = std::min(remaining.bytes, size);
        chunks.push_back({remaining.to, remaining.from, bytes, remaining.part});
        remaining.to += bytes, remaining.from += bytes, remaining.bytes -= bytes;
      }
    }
    return chunks;
  }

  void* allocate(std::size_t bytes) {
    check_memory(used_ + bytes, max_memory_);
    void* memory = nullptr;
    const cudaError_t error = cudaMalloc(&memory, bytes);
    if (error == cudaErrorMemoryAllocation)
      (void)cudaGetLastError();  // clears the error: the next frame may fit
    check_cuda(error, "allocate");
    used_ += bytes;
    return memory;
  }

  /// A buffer whose capacity *count may exceed.
  struct Fit {
    const std::int64_t* count;
    std::int64_t per_item, capacity;  ///< elements per item; capacity in items
    Growing* buffer;
  };
  static constexpr const char* kNoPass = "";
  /// Bytes of pinned memory for downloads, and the same number again for uploads.
  static constexpr std::size_t kStagingBytes = std::size_t{16} << 20;
  static constexpr std::size_t kChunkBytes = kStagingBytes / kChunks;
  /// Threads that copy out of pinned memory: one copies a fifth of what the bus transfers.
  static constexpr std::size_t kCopyThreads = 8;

  int device_ = 0, processors_ = 1;
  bool overlaps_kernels_ = false, times_passes_ = false, is_in_frame_ = false;
  cudaStream_t stream_ = nullptr;         ///< stream of the passes
  cudaStream_t copy_stream_ = nullptr;    ///< stream of downloads
  cudaStream_t totals_stream_ = nullptr;  ///< the one of both that copies the totals
  char* staging_ = nullptr;  ///< pinned memory: kStagingBytes for downloads, then for uploads
  std::array<cudaEvent_t, kChunks> arrived_ = {};  ///< per chunk of the memory for downloads
  std::array<cudaEvent_t, 2> written_ = {};        ///< per value of Written
  std::vector<Download> downloads_;                ///< not yet started
  std::vector<Fit> fits_;
  /// Bytes of the buffers, their limit (0: none), and the bytes that uploads have staged so far.
  std::size_t used_ = 0, max_memory_ = 0, staged_bytes_ = 0;
  std::vector<Mark> marks_;
  std::size_t used_marks_ = 0;
};

}  // namespace polymorph
