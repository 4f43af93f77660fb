// Metaball fitting: a nonlinear least-squares fit (Levenberg-Marquardt) of a Gaussian field to a
// solid's boundary.
#pragma once

#include <vector>

#include "base/box.h"
#include "base/result.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "spheres/boundary.h"
#include "spheres/spheres.h"

namespace polymorph {

struct FitSettings {
  bool ellipsoids = true;  ///< fit ellipsoids; false: round balls only
  int iterations = 30;     ///< number of Levenberg-Marquardt steps, without those of the passes
  int rounds = 6;  ///< number of times that the least useful balls are moved to the largest errors
  int passes = 3;  ///< number of searches of the whole surface for parts far from the model
};

struct FitResult {
  std::vector<Ball> balls;  ///< one per sphere; their surface is at field = 1
  double rms = 0;  ///< RMS of the signed distance e (see fit_balls()) at the samples, scene units
  int iterations = 0;  ///< number of steps made; a round that ends early counts as complete
};

/// Fits Gaussian balls whose surface, psi = ln(field) = 0, passes through the boundary samples.
/// Minimizes Huber's loss of the residual e - target, where e = psi / |grad psi| is the first-order
/// signed distance. The target is 0 at the samples. At points offset from the samples along their
/// normals, it is the offset (positive inside). At points throughout the box, only a wrong sign of
/// e counts. Levenberg-Marquardt steps change the weight, the centre and the six parameters of each
/// ball's ellipsoid (docs/method.md, Fit). The fit starts with one ball per sphere: an ellipsoid
/// that approximates the region of the solid that is nearest to this sphere. Finally, constraints
/// remove parts of the surface that lie far from the model. Deterministic for any number of
/// threads. Errors: as extract_surface().
Result<FitResult> fit_balls(const Model& model, const InsideTest& inside,
                            const std::vector<BoundarySample>& samples,
                            const std::vector<Sphere>& spheres, const FitSettings& settings);

/// Continues a fit from balls that were fitted to a similar model, for example the previous pose.
/// No ball is moved to another part of the model: `settings.rounds` and `passes` are not used.
Result<FitResult> refit_balls(const Model& model, const InsideTest& inside,
                              const std::vector<BoundarySample>& samples,
                              const std::vector<Ball>& balls, const FitSettings& settings);

/// Moves and shrinks balls that extend beyond the box, but only if the surface of all balls extends
/// beyond it by more than 0.08 of its diagonal. A fit diverges like this if faces disagree about
/// what is inside; the fit of a sound model stays far within this limit.
std::vector<Ball> move_into_box(std::vector<Ball> balls, const Box& box);

}  // namespace polymorph
