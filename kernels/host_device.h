// The macros of the kernels.
#pragma once

/// Marks a function that g++ and nvcc both compile.
#if defined(__CUDACC__)
#define PM_HD __host__ __device__
#else
#define PM_HD
#endif

/// Stands before an inner loop over lanes: keeps g++ from unrolling it before it can become a
/// vector (it then vectorises the loop over balls instead, which is five times slower).
#if defined(__GNUC__) && !defined(__CUDACC__) && !defined(__clang__)
#define PM_LANES _Pragma("GCC unroll 1")
#else
#define PM_LANES
#endif
