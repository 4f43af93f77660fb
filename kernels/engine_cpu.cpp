// The CPU backend's engine.
#include "backend_engine.h"
#include "cpu_backend.h"

namespace polymorph {

std::unique_ptr<Engine> make_cpu_engine() { return std::make_unique<BackendEngine<CpuBackend>>(); }

}  // namespace polymorph
