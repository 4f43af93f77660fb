// The CUDA backend's passes for inverse-square balls.
#include "ball_passes.h"
#include "cuda_backend.cuh"

namespace polymorph {

PM_BALL_PASSES(CudaBackend, Field<InverseSquareField, RoundBall>);

}  // namespace polymorph
