// Parallel loops on oneTBB, and the number of threads that they use.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstdint>
#include <string>

#include "base/result.h"
#include "kernels/fork_join.h"

namespace polymorph {

/// Limits all parallel work of the process to `count` threads; 0 = as many as this process may use
/// (the minimum of CPU affinity and SLURM_CPUS_PER_TASK). Call before the first parallel work.
void set_thread_count(int count);

/// Checks that a thread can be started. Errors: kResource, with the reason.
Status check_threads();
/// Makes the error of check_threads(), for a thread that could not be started later.
Error make_thread_error(const std::string& reason);

/// Number of threads that parallel work uses now (>= 1).
int thread_count();

/// Calls f(begin, end) for disjoint ranges of [0, n), in any order and on any thread. Ranges of up
/// to `grain` indices are not divided further. Results must not depend on how [0, n) is divided:
/// write by index, then reduce in a fixed order.
template <class F>
void parallel_ranges(std::int64_t n, std::int64_t grain, const F& f) {
  ForkJoin loop;  // ends the loop early on request (kernels/interruption.h)
  tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, n, grain),
                    [&](const tbb::blocked_range<std::int64_t>& r) {
                      loop.part([&] { f(r.begin(), r.end()); });
                    });
}

/// Calls f(i) for each i in [0, n).
template <class F>
void parallel_for(std::int64_t n, const F& f, std::int64_t grain = 1) {
  parallel_ranges(n, grain, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) f(i);
  });
}

}  // namespace polymorph
