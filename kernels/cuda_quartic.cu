// The CUDA backend's passes for quartic balls.
#include "ball_passes.h"
#include "cuda_backend.cuh"

namespace polymorph {

PM_BALL_PASSES(CudaBackend, Field<QuarticField, RoundBall>);
PM_BALL_PASSES(CudaBackend, Field<QuarticField, EllipsoidBall>);

}  // namespace polymorph
