// Morph quality metrics: the ten principles of Gomes et al. 1998 (report 3.8.1) as numbers, and
// measures of every frame's surface. Formulas: docs/method.md, Quality.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analyze/roughness.h"
#include "base/matrix_decompositions.h"
#include "kernels/linear.h"
#include "kernels/mesh.h"
#include "kernels/types.h"
#include "mesh/mesh_check.h"

namespace polymorph {

/// A similarity transformation: q = shift + scale * rotation * p.
struct Similarity {
  Mat3 rotation;
  double scale = 1;
  Vec3d shift;
};

/// Fits a similarity between two lists of corresponding points (Umeyama 1991). Returns nullopt if a
/// point misses its partner by more than 1e-3 of the RMS radius of `to`.
std::optional<Similarity> fit_similarity(const std::vector<Vec3>& from,
                                         const std::vector<Vec3>& to);

/// The boundary stage between an object's own mesh and the surface of the first or last frame: its
/// meshes at uniform steps. They lead from the object's mesh to the mesh that the surface of the
/// balls replaces. At the target they are in reverse order of time.
struct Handover {
  std::vector<Mesh> shown;
};

/// Errors of pairs of points that are known to correspond (analyze/true_points.h).
struct TrueErrors {
  std::size_t points = 0;  ///< number of pairs
  /// For each point of both objects: its distance from the position to which its partner is moved,
  /// over the diagonal of the point's object. `plan` moves points with the nearest balls, `map` by
  /// the map of the surface.
  std::vector<double> plan, map;
  /// Distance along the target's edges from the position to which the map moves each source point
  /// to the point's partner, over the square root of the target's area; infinite between
  /// components.
  std::vector<double> geodesic;
  /// Angle about the vertical, in degrees, between the morph's rotation and the rotation that fits
  /// the points; empty if no rotation fits them.
  std::optional<double> facing;
};

/// The two ends of a morph. Unknown members stay empty; metrics that need them are then empty too.
struct MorphEnds {
  std::string actor;                      ///< name of the actor; empty if there is just one
  std::string from, to;                   ///< names of the objects
  Mesh source, target;                    ///< meshes of the objects; normals are not needed
  std::vector<double> masses;             ///< masses of the moving balls
  std::optional<double> purity, chance;   ///< label purity of the plan and of a random plan
  std::vector<double> landmark_errors;    ///< distance of each landmark from its target
  std::optional<Similarity> truth;        ///< moves the source to the target, if a similarity does
  std::optional<Similarity> recovered;    ///< estimate of `truth` by the plan
  std::optional<TrueErrors> true_errors;  ///< errors of points whose partners are known
  std::optional<double> facing;  ///< degrees about the vertical between the plan's rotation and the
                                 ///< best fit of its pairs
  std::optional<double> registration;  ///< larger missed_fraction() of the two objects' surfaces
  std::optional<double> pose_step;     ///< moving ends: largest step of the surface by a change of
                                       ///< poses alone, over the step of the ends
  Handover leaving, arriving;          ///< boundary stages of both ends; empty if not shown
  bool source_shown = true;            ///< the object itself is shown before the first frame
  bool target_shown = true;            ///< the object itself is shown after the last frame
};

/// One frame of the morph.
struct MorphFrame {
  double time = 0;  ///< [0, 1]
  double u = 0;     ///< eased time, [0, 1]
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
  double rate = 0;      ///< step / change of u
  double speed = 0;     ///< RMS step of the balls to the next frame; `step` without balls
  double leakage = 0;   ///< volume outside the hull of both objects, dilated by 2 %
  double strain = 0;    ///< RMS of ln(distance of neighbouring balls / interpolated distance)
  double hull = 0;      ///< volume of the convex hull
  double lowest = 0;    ///< y of the lowest point
  double height = 0;    ///< height of the surface
  std::optional<double> distortion;      ///< conformal_distortion() since the first frame
  std::optional<double> off_similarity;  ///< Hausdorff distance from the moved source, over L
};

/// One number of the quality report.
struct Metric {
  std::string name;
  std::string principle;        ///< one of the ten principles, "5 smoothness"
  std::optional<double> value;  ///< empty if it cannot be measured
  std::string goal;             ///< "<= 2"; empty if there is none
  std::string definition;       ///< a phrase for the report
};

/// The measures and metrics of one morph.
struct Analysis {
  std::string actor, from, to;
  std::vector<FrameMeasures> frames;
  std::vector<Metric> metrics;
  /// Returns the metric of this name or null.
  const Metric* find(const std::string& name) const;
};

/// Returns "source -> target", preceded by "actor: " if the actor has a name.
std::string morph_name(const Analysis& morph);

/// Measures a morph, deterministically. Takes at least two frames, ordered by time.
Analysis analyze_morph(const MorphEnds& ends, const std::vector<MorphFrame>& frames);

}  // namespace polymorph
