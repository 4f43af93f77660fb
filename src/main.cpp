#include <malloc.h>

#include <cstdio>

#include "base/result.h"
#include "cli/command_line.h"

int main(int argc, char** argv) {
#if defined(__AVX2__) && defined(__FMA__)
  // Without this check the program would die of an illegal instruction.
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
    std::fputs(
        "error: this program was built for processors with AVX2 and FMA (x86-64-v3); "
        "build it with -DPOLYMORPH_ARCH=x86-64-v2\n",
        stderr);
    return static_cast<int>(polymorph::ErrorCode::kResource);
  }
#endif
#ifdef M_ARENA_MAX  // glibc
  // With glibc's eight arenas per core, memory that a thread frees stays in its arena, and a long
  // film takes more and more memory.
  mallopt(M_ARENA_MAX, 1);
#endif
  return polymorph::run_program(argc, argv);
}
