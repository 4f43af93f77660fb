// Rigid parts (as-rigid-as-possible blending) that move separately and stay joined: the path
// `parts`.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "base/matrix_decompositions.h"
#include "morph/plan.h"

namespace polymorph {

/// The part that each pair belongs to, and the alignment of each part with its counterpart.
struct RigidParts {
  std::vector<Alignment> alignments;
  std::vector<std::uint32_t> part_of;  ///< one per pair
};

/// Divides a plan's pairs into parts. If pairs within one label hold most of the mass, there is a
/// part per label; otherwise one per matched limb (MorphPlan::from_limbs), if any. All other pairs
/// then move with the whole object. Without labels and limbs, the parts are at most eight clusters
/// of pairs that are neighbours in both objects, if neighbours then keep their distances better
/// than in a single part. Each part has its own rotation, scaling and translation, and rotates in
/// the direction that is nearer to the whole object's. Deterministic.
RigidParts rigid_parts(const MorphPlan& plan);

/// Lists the matched limb that holds both balls of each pair, counted from 1; 0 if none does. Empty
/// for a plan without limbs.
std::vector<std::uint32_t> parts_by_limb(const MorphPlan& plan);

/// Makes the parts of a plan whose balls were moved to another pose than in `reference`. Each pair
/// stays in its part; the alignments are fitted again.
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

  /// Solves for positions near `places`, the balls' positions by their parts, whose edges are as
  /// near as possible to their targets. A target has the length (1-u) |p_e - p_f| + u |q_e - q_f|
  /// and is rotated by the balls' rotations: at first `turns`, then twice fitted to the result. At
  /// u = 0 (1) with the source's (target's) positions, the result is `places`. `progress`: u of
  /// each pair.
  std::vector<Vec3d> joined(std::span<const Vec3d> places, std::span<const Mat3> turns,
                            std::span<const double> progress) const;

 private:
  struct System;
  using Links = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  static Links find_links(const MorphPlan& plan);
  BallGraph(const MorphPlan& plan, const RigidParts& parts, const Links& links);

  std::unique_ptr<const System> system_;
};

}  // namespace polymorph
