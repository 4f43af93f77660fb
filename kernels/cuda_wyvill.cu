// The CUDA backend's passes for balls of Wyvill's field.
#include "ball_passes.h"
#include "cuda_backend.cuh"

namespace polymorph {

PM_BALL_PASSES(CudaBackend, Field<WyvillField, RoundBall>);
PM_BALL_PASSES(CudaBackend, Field<WyvillField, EllipsoidBall>);

}  // namespace polymorph
