// Denormal handling of the calling thread (registers MXCSR of x86-64, FPCR of aarch64), for as long
// as a guard lives.
//
// Embree asks for flush-to-zero, because its kernels slow down by an order of magnitude on
// denormals; the kernels need IEEE arithmetic, so that their results have the same bits everywhere.
// Both run in the same TBB threads, so each sets the mode that it needs. x86-64 flushes a result
// that is below the normal numbers after rounding, aarch64 one that is below them before rounding.
// They differ where a product or sum rounds up to exactly 2^-126 (floats) or 2^-1022 (doubles).
#pragma once

#include <cstdint>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace polymorph {

#if defined(__SSE__)
using DenormalMode = unsigned;
inline constexpr DenormalMode kFlushMode = 0x8040u;  ///< flush to zero, denormals are zero
inline DenormalMode denormal_register() { return _mm_getcsr(); }
inline void set_denormal_register(DenormalMode mode) { _mm_setcsr(mode); }
#elif defined(__aarch64__)
using DenormalMode = std::uint64_t;
inline constexpr DenormalMode kFlushMode = std::uint64_t{1} << 24;  ///< FZ: inputs and results
inline DenormalMode denormal_register() {
  DenormalMode mode;
  asm volatile("mrs %0, fpcr" : "=r"(mode));
  return mode;
}
inline void set_denormal_register(DenormalMode mode) { asm volatile("msr fpcr, %0" : : "r"(mode)); }
#else
#error "How this processor flushes denormals is not written down here."
#endif

/// Flushes denormals (kFlush) or keeps them, and restores the previous mode in the destructor.
template <bool kFlush>
class DenormalGuard {
 public:
  DenormalGuard() : saved_(denormal_register()) {
    set_denormal_register(kFlush ? saved_ | kFlushMode : saved_ & ~kFlushMode);
  }
  ~DenormalGuard() { set_denormal_register(saved_); }
  DenormalGuard(const DenormalGuard&) = delete;
  DenormalGuard& operator=(const DenormalGuard&) = delete;

 private:
  DenormalMode saved_;
};
using FlushDenormals = DenormalGuard<true>;
using KeepDenormals = DenormalGuard<false>;  ///< IEEE arithmetic

}  // namespace polymorph
