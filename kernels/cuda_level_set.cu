// The CUDA backend's passes for level sets and regressions.
#include "cuda_backend.cuh"
#include "level_set_passes.h"

namespace polymorph {

template void extract_distances<CudaBackend>(Workspace<CudaBackend>&,
                                             const std::shared_ptr<const DistanceGrid>&,
                                             const Grid&, const ExtractSettings&, Mesh&);
template void extract_morph<CudaBackend>(Workspace<CudaBackend>&, const MorphSurface&, const Grid&,
                                         const ExtractSettings&, Mesh&);
template void sample_map<CudaBackend>(Workspace<CudaBackend>&,
                                      const std::shared_ptr<const Regression>&,
                                      const std::vector<Vec3>&, std::vector<AttributeValues>&);

}  // namespace polymorph
