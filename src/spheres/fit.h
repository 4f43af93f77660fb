// Metaball fitting: a nonlinear least-squares fit (Levenberg-Marquardt) of a Gaussian field to a
// solid's boundary.
#pragma once

#include <cstddef>
#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "spheres/boundary.h"
#include "spheres/spheres.h"

namespace polymorph {

struct FitSettings {
  bool ellipsoids = true;  ///< let balls stretch; false: round ones only
  int iterations = 30;     ///< Levenberg-Marquardt steps in all
  int rounds = 6;          ///< times that the least useful balls move to the worst places
  int passes = 3;          ///< looks at the whole surface for what lies far from the model
};

struct FitResult {
  std::vector<Ball> balls;  ///< surface at field = 1, as many as spheres were given
  double rms = 0;           ///< of the first-order distance at the samples, in scene units
  int iterations = 0;
};

/// Moves, sizes and weighs Gaussian balls so that the surface psi = ln(field) = 0 passes through
/// the boundary samples: minimizes the first-order signed distance e = psi / |grad psi| at the
/// samples, at samples offset along the normal (target = the offset), and, where their sign is
/// wrong, at points spread through the box, under Huber's loss. Levenberg-Marquardt over weight,
/// centre and the six numbers of each ball's ellipsoid (docs/method.md, Fit). Starts from one ball
/// per sphere: the part of the solid that it stands for, as an ellipsoid. At last the surface
/// itself is looked at, and what of it lies far from the model is pushed away. Deterministic for
/// any number of threads. Errors: as extract_surface().
Result<FitResult> fit_balls(const Model& model, const InsideTest& inside,
                            const std::vector<BoundarySample>& samples,
                            const std::vector<Sphere>& spheres, const FitSettings& settings);

/// The balls as they are, unless their surface reaches further than 0.08 of the diagonal beyond
/// the box: then all that reach beyond it are moved and shrunk into it. A fit goes astray so where
/// faces disagree about what is inside; of a sound model none comes near.
std::vector<Ball> within_box(std::vector<Ball> balls, const Box& box);

}  // namespace polymorph
