// Macros for code that g++ and nvcc both compile.
#pragma once

/// Marks a function that g++ and nvcc both compile.
#if defined(__CUDACC__)
#define PM_HD __host__ __device__
#else
#define PM_HD
#endif

/// Unrolls the following loop by 4 on the GPU, to keep four loads in flight.
#if defined(__CUDA_ARCH__)
#define PM_UNROLL _Pragma("unroll 4")
#else
#define PM_UNROLL
#endif
