// The CPU backend's engine for AVX-512, 16 points at a time. This file is compiled for
// x86-64-v4. All its symbols except pm_make_avx512_engine are made local (cmake/avx512.cmake), so
// that the linker does not choose an inline function compiled here for code that older processors
// run.
#include "backend_engine.h"
#include "ball_passes.h"
#include "cpu_backend.h"
#include "level_set_passes.h"
#include "motion_passes.h"

extern "C" polymorph::Engine* pm_make_avx512_engine() {
  return new polymorph::BackendEngine<polymorph::BasicCpuBackend<polymorph::WidePack>>();
}
