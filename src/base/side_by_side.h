// Functions that run at the same time, each of which may contain parallel loops.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cstdint>
#include <exception>
#include <vector>

#include "kernels/fork_join.h"

namespace polymorph {

/// Calls f through all.part(). While f waits for its own loops, this thread takes up no other work.
/// Stores an exception of f in `thrown`: if it left a task of TBB, it would cancel the loops of the
/// other tasks, which would then use, or even store, incomplete data.
template <class F>
void call_isolated(ForkJoin& all, std::exception_ptr& thrown, const F& f) {
  try {
    all.part([&] {
      try {
        tbb::this_task_arena::isolate(f);
      } catch (...) {
        thrown = std::current_exception();
      }
    });
  } catch (...) {  // part() has been interrupted
    thrown = std::current_exception();
  }
}

/// Calls f(i) for each i in [0, count), at the same time as far as threads are free. A thread that
/// waits in one call starts no other call. After all calls have ended, rethrows the exception of
/// the lowest i that threw one.
template <class F>
void run_all_side_by_side(std::int64_t count, const F& f) {
  ForkJoin all;
  std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(count));
  std::exception_ptr* const thrown_by = thrown.data();
  tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, count, /*grainsize=*/1),
                    [&all, &f, thrown_by](const tbb::blocked_range<std::int64_t>& range) {
                      for (std::int64_t i = range.begin(); i < range.end(); ++i)
                        call_isolated(all, thrown_by[i], [&f, i] { f(i); });
                    });
  for (const std::exception_ptr& exception : thrown)
    if (exception) std::rethrow_exception(exception);
}

/// Calls both functions, at the same time if a second thread is free. A thread that waits in one of
/// them takes up no work of the other: thus a lock that is held around a loop is not held longer,
/// and each function's memory is needed only once. Neither function may write data that the other
/// one reads. Rethrows an exception after both have ended.
template <class F, class G>
void run_side_by_side(const F& first, const G& second) {
  run_all_side_by_side(2, [&](std::int64_t i) { i == 0 ? first() : second(); });
}

}  // namespace polymorph
