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

/// Errors of an approximation. Distances are relative to the diagonal of the model's box.
struct ApproximationQuality {
  double iou = 0;           ///< volume of the intersection over that of the union
  double volume_ratio = 0;  ///< volume of the surface / volume of the model
  double rms_to_model = 0, hausdorff_to_model = 0;      ///< distances of the surface's points
  double rms_to_surface = 0, hausdorff_to_surface = 0;  ///< distances of the model's points
  std::size_t triangles = 0;                            ///< triangles of the surface
};

struct QualitySettings {
  int grid = 96;        ///< cells of the extracted surface along the model's longest side
  double points = 3e5;  ///< lattice points that measure volumes (standard error 0.0005)
};

/// Compares the balls' surface (field = 1) with the model. Volumes are measured by counting the
/// points of one jittered lattice that are inside each. Distances are measured at 20 000 samples of
/// each surface and at every vertex of the extracted one. If the field has no surface, `iou` is 0
/// and distances are 1. Errors: as extract_surface().
Result<ApproximationQuality> measure_quality(const Model& model, const InsideTest& inside,
                                             const std::vector<Ball>& balls, FieldKind kind,
                                             const QualitySettings& settings);

/// Tests whether `iou` is at least 0.7 and no distance exceeds 0.15.
bool is_good_fit(const ApproximationQuality& quality);
/// Describes a fit with numbers and, if it is poor, with advice.
std::string describe_fit(const ApproximationQuality& quality);

/// Computes the Hausdorff distance between the balls' surface and the model, relative to the
/// diagonal of the model's box. `samples` represent the model's boundary. Without fitted balls, it
/// is the largest distance from a sample to the spheres. Errors: as extract_surface().
Result<double> hausdorff_distance(const Model& model, const std::vector<BoundarySample>& samples,
                                  const Approximation& approximation);

/// Computes the volume that a model encloses: exactly for one closed shell, by counting lattice
/// points if shells overlap or are open.
double solid_volume(const Model& model, const InsideTest& inside);

/// Computes the ratio of the volume in which the balls' field exceeds 1 to the volume of the model,
/// both counted on one lattice. Errors: as extract_surface().
Result<double> lattice_volume_ratio(const Model& model, const InsideTest& inside,
                                    const std::vector<Ball>& balls);

}  // namespace polymorph
