// The CPU backend's engines: one for the instructions that the program is compiled for and, if the
// build has it (PM_AVX512), one for AVX-512, which is chosen if the processor supports it. The
// headers *_passes.h define the passes that BackendEngine calls (passes.h).
#include "backend_engine.h"
#include "ball_passes.h"
#include "cpu_backend.h"
#include "level_set_passes.h"
#include "motion_passes.h"

#if defined(PM_AVX512)
// Defined in engine_avx512.cpp, whose other symbols are local (cmake/avx512.cmake). The caller owns
// the engine.
extern "C" polymorph::Engine* pm_make_avx512_engine();
#endif

namespace polymorph {
namespace {

std::unique_ptr<Engine> make_avx512_engine() {
#if defined(PM_AVX512)
  // engine_avx512.cpp is compiled for x86-64-v4, which has these features.
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    return std::unique_ptr<Engine>(pm_make_avx512_engine());
  }
#endif
  return nullptr;
}

}  // namespace

std::unique_ptr<Engine> make_cpu_engine(CpuIsa isa) {
  std::unique_ptr<Engine> engine;
  if (isa != CpuIsa::kBaseline) engine = make_avx512_engine();
  if (engine == nullptr && isa != CpuIsa::kAvx512) {
    engine = std::make_unique<BackendEngine<CpuBackend>>();
  }
  return engine;
}

}  // namespace polymorph
