// The CPU backend's extractor.
#include "cpu_backend.h"
#include "extract.h"

namespace polymorph {

std::unique_ptr<SurfaceExtractor> make_cpu_extractor() {
  return std::make_unique<Extraction<CpuBackend>>();
}

}  // namespace polymorph
