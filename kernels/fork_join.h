// Wrapper of a parallel loop: ends the loop early on request (interruption.h), and tells
// ThreadSanitizer where it begins and ends. TBB's library is not instrumented, so ThreadSanitizer
// would otherwise see no order between a loop and the code around it, and report races.
#pragma once

#include "interruption.h"

#if defined(__SANITIZE_THREAD__)
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
#endif

namespace polymorph {

/// Exists while one loop runs. The loop passes each chunk of its work to part(), which runs it.
class ForkJoin {
 public:
  ForkJoin() { release(&fork_); }
  ~ForkJoin() { acquire(&join_); }
  ForkJoin(const ForkJoin&) = delete;
  ForkJoin& operator=(const ForkJoin&) = delete;

  template <class F>
  void part(const F& f) {
    check_interruption();
    acquire(&fork_);
    f();
    release(&join_);
  }

 private:
#if defined(__SANITIZE_THREAD__)
  static void acquire(char* mark) { __tsan_acquire(mark); }
  static void release(char* mark) { __tsan_release(mark); }
#else
  static void acquire(char*) {}
  static void release(char*) {}
#endif
  char fork_ = 0, join_ = 0;  ///< their addresses stand for the loop's begin and end
};

}  // namespace polymorph
