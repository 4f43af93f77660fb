// Measures of one frame of a morph, and their columns in the reports.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "analyze/roughness.h"
#include "kernels/linear.h"
#include "kernels/mesh.h"
#include "mesh/mesh_check.h"

namespace polymorph {

/// One frame of the morph.
struct MorphFrame {
  double time = 0;  ///< [0, 1]
  double u = 0;     ///< eased time, [0, 1]; equal to `time` if the easing is unknown
  Mesh surface;
  std::vector<Vec3> centers;  ///< moving balls, in the same order in all frames; may be empty
};

/// Measures of one frame; lengths, areas and volumes are in scene units. L is the diagonal of the
/// bounding box of both objects.
struct FrameMeasures {
  double time = 0, u = 0;
  MeshReport surface;
  double bending = 0;   ///< integral of the squared mean curvature
  Roughness roughness;  ///< relative to the box of the first and last frame (RoughnessScale)
  double step = 0;      ///< chamfer distance to the next frame; 0 at the last
  double farthest = 0;  ///< Hausdorff distance to the next frame; 0 at the last
  double rate = 0;      ///< step / change of u to the next frame; 0 if u does not change
  double speed = 0;     ///< RMS step of the balls to the next frame; `step` without balls
  double leakage = 0;   ///< volume outside the convex hull of both objects, dilated by 2 % of L
  double strain = 0;    ///< RMS of ln(distance of neighbouring balls / distance interpolated
                        ///< between the ends); 0 without balls
  double hull = 0;      ///< volume of the convex hull
  double lowest = 0;    ///< y of the lowest point; 0 for an empty surface
  double height = 0;    ///< extent of the surface along y
  /// conformal_distortion() since the first frame; empty unless all frames have the same triangles.
  std::optional<double> distortion;
  /// Hausdorff distance, over L, between this surface and that of the first frame, moved by the
  /// fraction u of the known similarity between the objects (MorphEnds::truth in analyze.h); empty
  /// if none is known.
  std::optional<double> off_similarity;
};

/// A measure of the frames: a column of the CSV file, a key of the JSON file, a curve of the page.
struct MeasureColumn {
  const char* name;
  const char* definition;  ///< a phrase for the report
  std::function<std::optional<double>(const FrameMeasures&)> value;
};
/// Lists the columns of all measures but the times, in the order of the reports.
const std::vector<MeasureColumn>& measure_columns();

/// Computes the measures that depend on this frame alone: times, surface, bending, hull, lowest and
/// height. The others stay as they are initialized.
FrameMeasures measure_frame(const MorphFrame& frame);

}  // namespace polymorph
