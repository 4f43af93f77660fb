// Tells ThreadSanitizer where a parallel loop begins and ends. TBB's library is not built for it,
// so that to it nothing would happen before a loop or after one, and every loop would be a race.
// Costs nothing in other builds.
#pragma once

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
