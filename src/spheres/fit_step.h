// Levenberg-Marquardt step of the metaball fit (conjugate gradients on the normal equations).
#pragma once

#include <vector>

#include "spheres/fit_field.h"

namespace polymorph {

/// Solves (J^T J + damping diag(J^T J)) step = -J^T r approximately, by conjugate gradients with
/// one small matrix per ball as preconditioner: J^T J is never formed, so time and memory grow with
/// the entries of J, not with the square of the ball count. Returns `numbers` values per ball.
std::vector<double> damped_step(const FitRows& rows, std::size_t ball_count, int numbers,
                                double damping);

}  // namespace polymorph
