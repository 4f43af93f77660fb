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

/// A rotation, a scaling and a shift: q = shift + scale rotation p.
struct Similarity {
  Mat3 rotation;
  double scale = 1;
  Vec3d shift;
};

/// The similarity of two point lists in the same order, if it is one to within 1e-3 of their size.
std::optional<Similarity> similarity_of(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

/// How an object's own mesh becomes the surface of the first frame, or the last frame's surface an
/// object's mesh (then it is run backwards): what is seen meanwhile, at even steps, from the mesh
/// to where it is taken for the balls' surface.
struct Handover {
  std::vector<Mesh> shown;
};

/// What one morph goes between; what is not known stays empty, and so do the numbers made of it.
struct MorphEnds {
  std::string actor;                     ///< whose morph it is; empty: the only one's
  std::string from, to;                  ///< names
  Mesh source, target;                   ///< the objects themselves, normals not needed
  std::vector<double> masses;            ///< of the moving balls
  std::optional<double> purity, chance;  ///< of labels: the plan's, and a random plan's
  std::vector<double> landmark_errors;   ///< distance of each landmark from where it should arrive
  std::optional<Similarity> truth;       ///< the target is the source, so moved
  std::optional<Similarity> recovered;   ///< what the plan took it for
  Handover leaving, arriving;            ///< the source's and the target's; empty: none is seen
  bool source_shown = true;              ///< the object itself is seen before the first frame
  bool target_shown = true;              ///< and after the last
};

/// One moment of the morph.
struct MorphFrame {
  double time = 0;  ///< [0, 1]
  double u = 0;     ///< eased
  Mesh surface;
  std::vector<Vec3> centers;  ///< of the moving balls, in the same order in all frames; or empty
};

struct FrameMeasures {
  double time = 0, u = 0;
  MeshReport surface;
  double bending = 0;   ///< integral of the squared mean curvature
  Roughness roughness;  ///< L: the diagonal of the first and the last frame's box
  double step = 0;      ///< chamfer distance to the next frame; 0 at the last
  double farthest = 0;  ///< Hausdorff distance to the next frame; 0 at the last
  double rate = 0;      ///< step / change of u
  double speed = 0;     ///< RMS step of the balls to the next frame, else `step`
  double leakage = 0;   ///< volume outside the hull of both objects, dilated by 2 %
  double strain = 0;    ///< RMS ln of the distances between neighbours over the even ones
  std::optional<double> off_similarity;  ///< Hausdorff distance from the moved source, over L
};

struct Metric {
  std::string name;
  std::string principle;        ///< which of the ten
  std::optional<double> value;  ///< empty: cannot be measured here
  std::string goal;             ///< "<= 2"
  std::string what;
};

struct Analysis {
  std::string actor, from, to;
  std::vector<FrameMeasures> frames;
  std::vector<Metric> metrics;
  const Metric* find(const std::string& name) const;
};

/// "a -> b", with the actor's name where there are several.
std::string morph_name(const Analysis& morph);

/// At least two frames, by rising time. Deterministic.
Analysis analyze_morph(const MorphEnds& ends, const std::vector<MorphFrame>& frames);

}  // namespace polymorph
