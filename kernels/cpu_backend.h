// The CPU backend of the extraction passes (backend_engine.h), on oneTBB. It runs in the caller's
// TBB arena; results do not depend on how TBB splits the ranges.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

#include "engine.h"
#include "floating_point.h"
#include "fork_join.h"
#include "large_pages.h"
#include "simd_math.h"
#include "tree.h"
#include "validate.h"
#include "view.h"

namespace polymorph {

/// A team of one thread that handles as many points at once as VectorOf has lanes.
template <class VectorOf>
struct CpuTeam {
  using V = VectorOf;
  static constexpr std::uint32_t kGroup = 1;  ///< number of threads in a group
  static constexpr int kParts = 1;            ///< number of teams that share a node of the tree

  template <class F>
  void each(int n, const F& f) const {
    for (int i = 0; i < n; ++i) f(i);
  }
  template <class F>
  void each_group(int n, const F& f) const {
    for (int i = 0; i < n; ++i) f(i);
  }
  void sync() const {}
  std::uint32_t group_rank() const { return 0; }
  bool leads_group() const { return true; }
  V group_sum(V a) const { return a; }
  template <class T>
  T group_max(T a) const {
    return a;
  }
  /// Adds to a sum that all teams of a node share.
  template <class T>
  void add(T& to, T value) const {
    to += value;
  }
  /// Calls write(slot) for each lane with a bit, at the lane's cursor, which then advances.
  template <class Write>
  void append(std::uint32_t bits, std::int64_t* cursors, const Write& write) const {
    for (; bits != 0; bits &= bits - 1) write(cursors[countr_zero(bits)]++);
  }
  /// Replaces n values by their exclusive prefix sums, followed by the total.
  std::uint32_t scan(std::uint32_t* values, int n) const {
    std::uint32_t sum = 0;
    for (int i = 0; i < n; ++i) {
      const std::uint32_t value = values[i];
      values[i] = sum;
      sum += value;
    }
    values[n] = sum;
    return sum;
  }
};

/// The CPU backend for packs V (Pack or WidePack); its members are those of backend_engine.h.
template <class V>
class BasicCpuBackend {
 public:
  using Team = CpuTeam<V>;
  static constexpr int kLanes = Lanes<V>::kCount;

  /// Uninitialised memory that only grows; contents are lost on growth.
  template <class T>
  class Buffer {
   public:
    View<T> resize(BasicCpuBackend& backend, std::int64_t n) {
      if (n > capacity_) {
        backend.used_ -= static_cast<std::size_t>(capacity_) * sizeof(T);
        data_.reset();
        capacity_ = 0;
        const std::int64_t capacity = n + n / 4;
        const std::size_t bytes = static_cast<std::size_t>(capacity) * sizeof(T);
        backend.claim(bytes);
        data_.reset(static_cast<T*>(::operator new(bytes, kAlignment)));
        request_large_pages(data_.get(), bytes);
        capacity_ = capacity;
      }
      return {data_.get(), n};
    }
    /// Allocates `per_item` elements for each of *count items. No guess is needed, because the pass
    /// that computes *count has finished.
    View<T> fit(BasicCpuBackend& backend, const std::int64_t* count, std::int64_t per_item,
                std::int64_t /*guess*/) {
      return resize(backend, *count * per_item);
    }

   private:
    static_assert(std::is_trivially_copyable_v<T>, "elements are never constructed");
    static constexpr std::align_val_t kAlignment{64};
    struct Free {
      void operator()(T* data) const { ::operator delete(data, kAlignment); }
    };
    std::unique_ptr<T, Free> data_;
    std::int64_t capacity_ = 0;
  };

  /// Calls f(i) for i in [0, n), in any order.
  template <class F>
  void for_each(std::int64_t n, const F& f, const char* name) {
    const PassTimer timer(*this, name);
    for_ranges(n, /*max_grain=*/64, [&f](std::int64_t begin, std::int64_t end) {
      const F local = f;  // keeps constants in registers: they are not reloaded after each store
      for (std::int64_t i = begin; i < end; ++i) local(i);
    });
  }

  static constexpr bool kHostMemory = true;  ///< whether passes work in the host's memory
  static constexpr bool kManyRoots = false;  ///< whether a tree has many roots, not one

  /// Calls f(team, scratch, i) for i in [0, *count * parts), in any order.
  template <class F>
  void for_teams(const std::int64_t* count, std::int64_t /*limit*/, const F& f, const char* name,
                 int parts = 1) {
    const PassTimer timer(*this, name);
    for_ranges(*count * parts, /*max_grain=*/16, [&f](std::int64_t begin, std::int64_t end) {
      const F local = f;
      typename F::Scratch scratch;
      for (std::int64_t i = begin; i < end; ++i) local(Team{}, scratch, i);
    });
  }

  /// Calls f(team, scratch, i) for i in [0, n), in any order.
  template <class F>
  void for_teams(std::int64_t n, const F& f, const char* name) {
    for_teams(&n, n, f, name);
  }

  /// Sets offsets[i] = start + counts[0] + ... + counts[i - 1] for i < *n, and *total to start plus
  /// the sum of all.
  void scan(View<const Counts> counts, const std::int64_t* n, View<Offsets> offsets, Offsets* total,
            const char* name, Offsets start = {}) {
    const PassTimer timer(*this, name);
    Offsets sum = start;
    const std::int64_t size = *n;
    for (std::int64_t i = 0; i < size; ++i) {
      offsets[i] = sum;
      sum = sum + Offsets{counts[i].a, counts[i].b};
    }
    *total = sum;
  }

  template <class T>
  void upload(View<T> to, const T* from) {
    std::copy(from, from + to.size, to.data);
  }
  template <class T>
  void download(T* to, View<T> from) {
    std::copy(from.data, from.data + from.size, to);
  }

  /// Resizes a result to *count elements and returns its own memory, so that passes write there.
  template <class T>
  View<T> output(std::vector<T>& result, Buffer<T>&, const std::int64_t* count, std::int64_t) {
    claim_result(static_cast<std::size_t>(*count) * sizeof(T));
    result.resize(static_cast<std::size_t>(*count));
    return {result.data(), *count};
  }
  /// Grows a result from `before` to `n` elements, which are about `fraction` of all elements that
  /// it will have. Reserves memory for all of them, so that later calls rarely copy.
  template <class T>
  View<T> grow(std::vector<T>& result, std::int64_t before, std::int64_t n, double fraction) {
    claim_result(static_cast<std::size_t>(n - before) * sizeof(T));
    const auto size = static_cast<std::size_t>(n);
    if (size > result.capacity()) {
      const double all = static_cast<double>(n) / fraction;
      // 25 % more, because `all` is an estimate until the last call.
      result.reserve(static_cast<std::size_t>(fraction < 1 ? 1.25 * all : all));
      request_large_pages(result.data() + result.size(),
                          (result.capacity() - result.size()) * sizeof(T));
    }
    if (size > result.size()) result.resize(size);
    return {result.data(), n};
  }
  /// Does nothing, because output() and grow() return the result's own memory.
  template <class T>
  void queue_download(std::vector<T>&, View<T>, std::int64_t, Written) {}

  static std::int64_t threads() { return tbb::this_task_arena::max_concurrency(); }

  void start_frame(std::size_t max_memory, bool /*time_passes*/) {
    times_.clear();
    results_ = 0;
    max_memory_ = max_memory;
  }
  /// Copies the totals. Returns true, because memory is allocated after its size is known.
  bool everything_fitted(View<Offsets> totals, Offsets* known) const {
    std::copy(totals.data, totals.data + totals.size, known);
    return true;
  }
  void finish_frame() {}
  std::vector<PassTime> pass_times() const { return times_; }
  std::size_t memory_used() const { return used_ + results_; }

 private:
  class PassTimer {
   public:
    PassTimer(BasicCpuBackend& backend, const char* name)
        : backend_(backend), name_(name), start_(std::chrono::steady_clock::now()) {}
    ~PassTimer() {
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
      add_pass_time(backend_.times_, name_, elapsed.count());
    }
    PassTimer(const PassTimer&) = delete;
    PassTimer& operator=(const PassTimer&) = delete;

   private:
    BasicCpuBackend& backend_;
    const char* name_;
    std::chrono::steady_clock::time_point start_;
  };

  void claim(std::size_t bytes) {
    check_memory(used_ + results_ + bytes, max_memory_);
    used_ += bytes;
  }
  void claim_result(std::size_t bytes) {
    check_memory(used_ + results_ + bytes, max_memory_);
    results_ += bytes;
  }

  /// Runs f(begin, end) over chunks of [0, n). A chunk has at most `max_grain` items, or fewer, so
  /// that there are about 8 chunks per thread.
  template <class F>
  static void for_ranges(std::int64_t n, std::int64_t max_grain, const F& f) {
    if (n <= 0) return;
    const std::int64_t grain = std::max<std::int64_t>(1, std::min(max_grain, n / (8 * threads())));
    ForkJoin loop;
    tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, n, grain),
                      [&](const tbb::blocked_range<std::int64_t>& r) {
                        // Rendering makes these threads flush denormals, which would
                        // change vertices.
                        const KeepDenormals keep;
                        loop.part([&] { f(r.begin(), r.end()); });
                      });
  }

  std::vector<PassTime> times_;
  /// Bytes of the buffers and of the results, and the limit of their sum (0: no limit).
  std::size_t used_ = 0, results_ = 0, max_memory_ = 0;
};

using CpuBackend = BasicCpuBackend<Pack>;

}  // namespace polymorph
