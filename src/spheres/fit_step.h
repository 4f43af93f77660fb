// Levenberg-Marquardt step of the metaball fit (conjugate gradients on the normal equations).
#pragma once

#include <vector>

#include "spheres/fit_field.h"

namespace polymorph {

/// Solves (J^T J + damping diag(J^T J)) step = -J^T r approximately, where J and r are the Jacobian
/// and the residuals of `rows`. Uses conjugate gradients, with one small matrix per ball as
/// preconditioner. J^T J is never formed, so time and memory are proportional to the number of
/// entries of J, not to the square of the ball count. Returns `parameters` values per ball.
std::vector<double> solve_damped_step(const FitRows& rows, std::size_t ball_count, int parameters,
                                      double damping);

}  // namespace polymorph
