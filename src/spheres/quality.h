// Approximation quality of balls: intersection over union, volume ratio, Hausdorff distance.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/mesh.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "spheres/boundary.h"
#include "spheres/spheres.h"

namespace polymorph {

/// Distances are shares of the diagonal of the model's box.
struct ApproximationQuality {
  double iou = 0;           ///< volume of the intersection over that of the union
  double volume_ratio = 0;  ///< the surface's over the model's
  double rms_to_model = 0, hausdorff_to_model = 0;      ///< from the surface
  double rms_to_surface = 0, hausdorff_to_surface = 0;  ///< from the model's boundary
  std::size_t triangles = 0;                            ///< of the surface
};

/// Compares the surface field = 1 of Gaussian or inverse-square balls, extracted on `grid` cells
/// along the longest side, with the model. Volumes are counted on one jittered lattice of some
/// `points` points (300 000: standard error about 0.0005), distances measured at 20 000 samples
/// each way and at every surface vertex. A model whose field has no surface: iou 0, distances 1.
/// Errors: as extract_surface().
Result<ApproximationQuality> measure_quality(const Model& model, const InsideTest& inside,
                                             const std::vector<Ball>& balls, FieldKind kind,
                                             int grid, double points = 3e5);

/// What is wrong with balls that stand badly for their model, with numbers and what to do; empty
/// for a good fit.
std::string describe_bad_fit(const ApproximationQuality& quality);

/// The larger of both Hausdorff distances, as a share of the diagonal, for the error-driven count.
Result<double> hausdorff_distance(const Model& model, const std::vector<BoundarySample>& samples,
                                  const Approximation& approximation);

/// What a model encloses: told by the faces of one closed shell, counted on a lattice where shells
/// overlap or are open.
double solid_volume(const Model& model, const InsideTest& inside);

/// Volume of the balls' field over that of the model, both counted on one lattice.
Result<double> lattice_volume_ratio(const Model& model, const InsideTest& inside,
                                    const std::vector<Ball>& balls);

}  // namespace polymorph
