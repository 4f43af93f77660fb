// Denormal handling (MXCSR) while rays are traced: Embree asks for flush-to-zero (its kernels slow
// down by an order of magnitude on denormals); the other rooms must not see it.
#pragma once

#include <xmmintrin.h>

namespace polymorph {

class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }  // FTZ | DAZ
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

}  // namespace polymorph
