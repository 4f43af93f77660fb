// Denormal handling (MXCSR register) of the calling thread, for as long as a guard lives.
//
// Embree asks for flush-to-zero, because its kernels slow down by an order of magnitude on
// denormals; the kernels need IEEE arithmetic, so that their results have the same bits everywhere.
// Both run in the same TBB threads, so each sets what it needs.
#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace polymorph {

template <bool kFlush>
class DenormalGuard {
 public:
#if defined(__SSE__)
  DenormalGuard() : saved_(_mm_getcsr()) {
    _mm_setcsr(kFlush ? saved_ | kFlags : saved_ & ~kFlags);
  }
  ~DenormalGuard() { _mm_setcsr(saved_); }
#else
  DenormalGuard() = default;
  ~DenormalGuard() = default;
#endif
  DenormalGuard(const DenormalGuard&) = delete;
  DenormalGuard& operator=(const DenormalGuard&) = delete;

 private:
#if defined(__SSE__)
  static constexpr unsigned kFlags = 0x8040u;  // flush to zero, denormals are zero
  unsigned saved_;
#endif
};
using FlushDenormals = DenormalGuard<true>;
using KeepDenormals = DenormalGuard<false>;  ///< IEEE arithmetic

}  // namespace polymorph
