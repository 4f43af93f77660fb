// Macros for code that g++ and nvcc both compile.
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

/// Stands before a loop whose loads a GPU should have on their way four rounds ahead.
#if defined(__CUDA_ARCH__)
#define PM_UNROLL _Pragma("unroll 4")
#else
#define PM_UNROLL
#endif
