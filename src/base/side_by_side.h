// Parts of the work side by side, each of which may contain parallel loops.
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/task_arena.h>

#include <cstdint>
#include <exception>
#include <vector>

#include "kernels/fork_join.h"

namespace polymorph {

/// Calls f as a part of `all` that takes up no other work while it waits, and returns what it
/// throws. An exception that left a task of TBB would cancel the loops of the other tasks: they
/// would return without their work, and what follows them would use unfilled data, or store it.
template <class F>
std::exception_ptr call_isolated(ForkJoin& all, const F& f) {
  try {
    all.part([&] { tbb::this_task_arena::isolate(f); });
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

/// Calls both functions, at the same time if a second thread is free. A thread that waits in one of
/// them takes up nothing of the other, so a lock that is held around a loop stays short, and the
/// memory is that of one call of each. Neither may write what the other reads. If one throws, the
/// other ends by itself first.
template <class F, class G>
void run_side_by_side(const F& first, const G& second) {
  ForkJoin both;
  std::exception_ptr from_first, from_second;
  tbb::parallel_invoke([&] { from_first = call_isolated(both, first); },
                       [&] { from_second = call_isolated(both, second); });
  if (from_first) std::rethrow_exception(from_first);
  if (from_second) std::rethrow_exception(from_second);
}

/// Calls f(i) for each i in [0, count), at the same time as far as threads are free. A thread that
/// waits in one call starts no other. If one throws, the others end by themselves first.
template <class F>
void run_all_side_by_side(std::int64_t count, const F& f) {
  ForkJoin all;
  std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(count));
  tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t i) {
    thrown[static_cast<std::size_t>(i)] = call_isolated(all, [&f, i] { f(i); });
  });
  for (const std::exception_ptr& exception : thrown)
    if (exception) std::rethrow_exception(exception);
}

}  // namespace polymorph
