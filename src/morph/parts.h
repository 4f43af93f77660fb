// Rigid parts (as-rigid-as-possible blending), for paths of the kind Path::kParts. Each part has
// its own motion, and a solve over neighbouring balls keeps the parts joined.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "base/matrix_decompositions.h"
#include "morph/plan.h"

namespace polymorph {

/// Parts of a plan: groups of pairs that move rigidly.
struct RigidParts {
  std::vector<Alignment> alignments;   ///< per part, the similarity from source to target
  std::vector<std::uint32_t> part_of;  ///< per pair, the index of its part
};

/// Divides a plan's pairs into parts, by the first of these rules that applies. (1) If pairs whose
/// balls have equal labels hold most of the mass, there is a part per label. (2) If the plan has
/// matched limbs (MorphPlan::from_limbs), there is a part per limb. With both rules, all other
/// pairs form part 0, which moves with the whole object. (3) The parts are at most eight clusters
/// of pairs that are close together in both objects, if the distances between neighbours then
/// change less than with a single part. (4) There is a single part. Each part has its own rotation,
/// scaling and translation; of its two directions of rotation, it takes the one nearer to the whole
/// object's rotation. Deterministic.
RigidParts rigid_parts(const MorphPlan& plan);

/// Lists for each pair the matched limb that holds both its balls, counted from 1; 0 if no limb
/// does. Empty for a plan without limbs.
std::vector<std::uint32_t> parts_by_limb(const MorphPlan& plan);

/// Makes the parts of `plan`, which has the pairs of `reference` but balls in another pose. Each
/// pair stays in its part; the alignments are fitted again.
RigidParts refit_parts(const MorphPlan& plan, const MorphPlan& reference);

/// Solves for as-rigid-as-possible positions on the graph of neighbouring balls, whose edges have a
/// target length at every time (Sorkine and Alexa 2007, "As-rigid-as-possible surface modeling").
/// The matrix is factorized once, so that a frame costs a few substitutions.
class BallGraph {
 public:
  /// `parts`: rigid_parts(plan).
  BallGraph(const MorphPlan& plan, const RigidParts& parts);
  /// The graph of balls in another pose, with the neighbours that they have in `reference`.
  BallGraph(const MorphPlan& plan, const RigidParts& parts, const BallGraph& reference);
  ~BallGraph();

  /// Solves for positions of the balls near `part_positions`, their positions by their parts alone,
  /// that keep the graph's edges as near as possible to their targets. The target of the edge from
  /// pair e to pair f has the length (1-u) |p_e - p_f| + u |q_e - q_f|. p and q are the centres of
  /// the source and target balls, and u is the mean of the pairs' `progress`. The target is rotated
  /// by the balls' rotations: `part_rotations` in the first of three solves, then rotations fitted
  /// to the previous result. At u = 0 (1) with the source's (target's) positions, the result is
  /// `part_positions`. All arguments have one element per pair.
  std::vector<Vec3d> join_balls(std::span<const Vec3d> part_positions,
                                std::span<const Mat3> part_rotations,
                                std::span<const double> progress) const;

 private:
  struct System;
  using Links = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  static Links find_links(const MorphPlan& plan);
  BallGraph(const MorphPlan& plan, const RigidParts& parts, const Links& links);

  std::unique_ptr<const System> system_;
};

}  // namespace polymorph
