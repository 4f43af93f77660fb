// The CPU side of the three things a backend is: for_each, exclusive_scan, Buffer. Runs in the
// caller's TBB arena; results do not depend on how TBB cuts the ranges.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "extract_surface.h"
#include "validate.h"
#include "view.h"

namespace polymorph {

/// IEEE arithmetic while it lives. Embree asks for flush-to-zero in every thread, and the same TBB
/// workers come here: whether a thread has rendered before must not change a vertex.
class StrictFloats {
 public:
#if defined(__SSE__)
  StrictFloats() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ & ~0x8040u); }
  ~StrictFloats() { _mm_setcsr(saved_); }
#else
  StrictFloats() = default;
  ~StrictFloats() = default;
#endif
  StrictFloats(const StrictFloats&) = delete;
  StrictFloats& operator=(const StrictFloats&) = delete;

 private:
#if defined(__SSE__)
  unsigned saved_;
#endif
};

class CpuBackend {
 public:
  /// Points handled together: one vector of AVX2.
  static constexpr int kLanes = 8;

  /// Uninitialised memory that only grows; contents are lost on growth.
  template <class T>
  class Buffer {
   public:
    View<T> resize(CpuBackend&, std::int64_t n) {
      if (n > capacity_) {
        data_.reset();
        capacity_ = 0;
        const std::int64_t wanted = n + n / 4;
        data_.reset(new T[static_cast<std::size_t>(wanted)]);
        capacity_ = wanted;
      }
      return {data_.get(), n};
    }

   private:
    std::unique_ptr<T[]> data_;
    std::int64_t capacity_ = 0;
  };

  /// Calls f(i) for i in [0, n), in any order.
  template <class F>
  void for_each(std::int64_t n, const F& f, const char* name) {
    static_assert(std::is_trivially_copyable<F>::value,
                  "a kernel is copied to the device as bytes");
    const Stopwatch watch(*this, name);
    ranges(n, 64, [&f](std::int64_t begin, std::int64_t end) {
      const F local = f;  // constants in registers, not reloaded after each store
      for (std::int64_t i = begin; i < end; ++i) local(i);
    });
  }

  /// offsets[i] = counts[0] + ... + counts[i - 1]; offsets has one element more than counts, the
  /// total.
  template <class Count, class Offset>
  void exclusive_scan(View<Count> counts, View<Offset> offsets, const char* name) {
    const Stopwatch watch(*this, name);
    constexpr std::int64_t kBlock = 1 << 15;
    const std::int64_t n = counts.size, blocks = (n + kBlock - 1) / kBlock;
    sums_.assign(static_cast<std::size_t>(blocks) + 1, 0);
    const auto end_of = [n](std::int64_t block) { return std::min(n, (block + 1) * kBlock); };
    ranges(blocks, 1, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t b = begin; b < end; ++b) {
        std::int64_t sum = 0;
        for (std::int64_t i = b * kBlock; i < end_of(b); ++i) sum += counts[i];
        sums_[b + 1] = sum;
      }
    });
    for (std::int64_t b = 0; b < blocks; ++b) sums_[b + 1] += sums_[b];
    ranges(blocks, 1, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t b = begin; b < end; ++b) {
        auto sum = static_cast<Offset>(sums_[b]);
        for (std::int64_t i = b * kBlock; i < end_of(b); ++i) {
          offsets[i] = sum;
          sum = static_cast<Offset>(sum + counts[i]);
        }
      }
    });
    offsets[n] = static_cast<Offset>(sums_[blocks]);
  }

  template <class T>
  void upload(View<T> to, const T* from) {
    std::copy(from, from + to.size, to.data);
  }
  template <class T>
  void download(T* to, View<T> from) {
    ranges(from.size, 1 << 15, [&](std::int64_t begin, std::int64_t end) {
      std::copy(from.data + begin, from.data + end, to + begin);
    });
  }
  template <class T>
  void fill_zero(View<T> to) {
    ranges(to.size, 1 << 16, [&](std::int64_t begin, std::int64_t end) {
      std::fill(to.data + begin, to.data + end, T{});
    });
  }

  void start_frame() { times_.clear(); }
  void finish_frame() {}
  std::vector<PassTime> pass_times() const { return times_; }

 private:
  class Stopwatch {
   public:
    Stopwatch(CpuBackend& backend, const char* name)
        : backend_(backend), name_(name), start_(std::chrono::steady_clock::now()) {}
    ~Stopwatch() {
      const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
      add_pass_time(backend_.times_, name_, spent.count());
    }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

   private:
    CpuBackend& backend_;
    const char* name_;
    std::chrono::steady_clock::time_point start_;
  };

  /// Runs f(begin, end) over parts of [0, n) of about `most` items, fewer where n is small.
  template <class F>
  static void ranges(std::int64_t n, std::int64_t most, const F& f) {
    if (n <= 0) return;
    const std::int64_t threads = tbb::this_task_arena::max_concurrency();
    const std::int64_t grain = std::max<std::int64_t>(1, std::min(most, n / (8 * threads)));
    tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, n, grain),
                      [&f](const tbb::blocked_range<std::int64_t>& r) {
                        const StrictFloats strict;
                        f(r.begin(), r.end());
                      });
  }

  std::vector<std::int64_t> sums_;
  std::vector<PassTime> times_;
};

}  // namespace polymorph
