// Frame of parallel loops. It makes them end early (interruption.h), and tells ThreadSanitizer
// where they begin and end: TBB's library is not built for it, so that to it nothing would happen
// before a loop or after one, and every loop would be a race.
#pragma once

#include "interruption.h"

#if defined(__SANITIZE_THREAD__)
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
#endif

namespace polymorph {

/// Lives around one loop; every part of the loop runs through part().
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
  char fork_ = 0, join_ = 0;
};

}  // namespace polymorph
