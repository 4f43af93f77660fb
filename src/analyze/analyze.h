// Morph quality metrics: the ten principles of Gomes et al. 1998 as numbers, and measures of every
// frame's surface. Section 3.8.1 of Gilbert's report (README.md) lists the principles; formulas:
// docs/method.md, Quality.
//
// A morph consists of a boundary stage, in which the source's mesh turns into the surface of its
// balls, a volumetric stage, in which the balls move, and a boundary stage at the target. Its
// frames are those of the volumetric stage. A sequence of mesh files has no other stage.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analyze/frame_measures.h"
#include "base/matrix_decompositions.h"
#include "kernels/linear.h"
#include "kernels/mesh.h"
#include "kernels/types.h"

namespace polymorph {

/// A similarity transformation: q = shift + scale * rotation * p.
struct Similarity {
  Mat3 rotation;
  double scale = 1;
  Vec3d shift;
};

/// Fits the similarity that moves the points `from` to the points `to` of the same indices (Umeyama
/// 1991). Returns nullopt if it misses one of them by more than 1e-3 of the RMS radius of `to`, or
/// if the lists have different sizes or fewer than four points.
std::optional<Similarity> fit_similarity(const std::vector<Vec3>& from,
                                         const std::vector<Vec3>& to);

/// Meshes of a boundary stage at uniform steps of time, from the object's own mesh to the last mesh
/// before the balls' surface. At the target they are in reverse order of time.
struct BoundaryMeshes {
  std::vector<Mesh> meshes;
};

/// Errors of pairs of points that are known to correspond (analyze/true_points.h).
struct TrueErrors {
  std::size_t points = 0;  ///< number of pairs
  /// Distances of the target's points, then of the source's points, from the positions to which
  /// their partners are moved, over the diagonal of the point's object. `plan` moves each partner
  /// with its nearest ball, `map` by the map of the surface. Empty: not measured.
  std::vector<double> plan, map;
  /// For each source point: distance along the target's edges from the position to which the map
  /// moves the point to the point's partner, over the square root of the target's area. It is
  /// infinite between components. Empty: not measured.
  std::vector<double> geodesic;
  /// Angle about the vertical, in degrees, between the morph's rotation and the rotation that fits
  /// the points; empty if no rotation fits them.
  std::optional<double> facing;
};

/// The two ends of a morph. Unknown members stay empty; metrics that need them are then empty too.
struct MorphEnds {
  std::string actor;           ///< name of the actor; empty if there is just one
  std::string from, to;        ///< names of the objects
  Mesh source, target;         ///< meshes of the objects; normals are not needed
  std::vector<double> masses;  ///< mass of each moving ball, in the order of MorphFrame::centers
  /// Fraction of the mass that moves to its own label, by the plan and by a random plan.
  std::optional<double> purity, chance;
  std::vector<double> landmark_errors;  ///< each landmark's distance from its target, scene units
  /// Similarity that moves the source's vertices onto the target's; empty if there is none.
  std::optional<Similarity> truth;
  std::optional<Similarity> recovered;    ///< similarity by which the plan aligns the objects
  std::optional<TrueErrors> true_errors;  ///< errors of points whose partners are known
  std::optional<double> facing;  ///< degrees about the vertical between the plan's rotation and the
                                 ///< best fit of its pairs
  /// The larger of both surfaces' missed_fraction() (analyze/registration_error.h).
  std::optional<double> registration;
  /// If the objects move during the morph: the largest ratio, over all frames, of the chamfer
  /// distance by which the surface moves when only the objects' poses change to those of the next
  /// frame, to the larger distance by which the objects move. Empty if they stand still.
  std::optional<double> pose_step;
  BoundaryMeshes leaving, arriving;  ///< stages of both objects; empty if not shown
  bool source_shown = true;          ///< whether the object itself is shown before the first frame
  bool target_shown = true;          ///< whether the object itself is shown after the last frame
};

/// One number of the quality report.
struct Metric {
  std::string name;
  std::string principle;        ///< number and name of a principle ("5 smoothness"); else "floor"
                                ///< or "surface"
  std::optional<double> value;  ///< empty if it cannot be measured
  std::string goal;             ///< comparison, space and number ("<= 2"); empty if there is none
  std::string definition;       ///< a phrase for the report
};

/// The measures and metrics of one morph.
struct Analysis {
  std::string actor, from, to;        ///< names, as in MorphEnds
  std::vector<FrameMeasures> frames;  ///< one per frame, by ascending time
  std::vector<Metric> metrics;        ///< all metrics of every morph, in the same order
  /// Returns the metric of this name or null.
  const Metric* find(const std::string& name) const;
};

/// Returns "source -> target", preceded by "actor: " if the actor has a name.
std::string morph_name(const Analysis& morph);

/// Measures a morph, deterministically. Takes at least two frames, ordered by time.
Analysis analyze_morph(const MorphEnds& ends, const std::vector<MorphFrame>& frames);

/// Lists the names of all metrics, in the order of Analysis::metrics.
std::vector<std::string> metric_names();

}  // namespace polymorph
