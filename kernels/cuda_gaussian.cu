// The CUDA backend's passes for Gaussian balls.
#include "ball_passes.h"
#include "cuda_backend.cuh"

namespace polymorph {

PM_BALL_PASSES(CudaBackend, Field<GaussianField, RoundBall>);
PM_BALL_PASSES(CudaBackend, Field<GaussianField, EllipsoidBall>);

}  // namespace polymorph
