// Parts of the work side by side, each of which may contain parallel loops.
#pragma once

#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <cstdint>

#include "base/parallel.h"
#include "kernels/fork_join.h"

namespace polymorph {

/// Calls both functions, at the same time if a second thread is free. A thread that waits in one of
/// them takes up nothing of the other, so a lock that is held around a loop stays short, and the
/// memory is that of one call of each. Neither may write what the other reads.
template <class F, class G>
void run_side_by_side(const F& first, const G& second) {
  ForkJoin both;
  tbb::parallel_invoke([&] { both.part([&] { tbb::this_task_arena::isolate(first); }); },
                       [&] { both.part([&] { tbb::this_task_arena::isolate(second); }); });
}

/// Calls f(i) for each i in [0, count), at the same time as far as threads are free. A thread that
/// waits in one call starts no other.
template <class F>
void run_all_side_by_side(std::int64_t count, const F& f) {
  parallel_for(count, [&](std::int64_t i) { tbb::this_task_arena::isolate([&f, i] { f(i); }); });
}

}  // namespace polymorph
