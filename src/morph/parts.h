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

/// A part per label where the labels that keep to themselves hold most of the mass; what leaves its
/// label moves with the whole. Else a part per matched limb (MorphPlan::from_limbs), where there
/// are any. Else at most eight clusters of pairs that are neighbours in both objects, if neighbours
/// then keep their distances better than with the whole as one part. Each with its own rotation,
/// scaling and shift; it rotates the way round that is nearer to the whole's. Deterministic.
RigidParts rigid_parts(const MorphPlan& plan);

/// Lists the matched limb that each pair stays in, counted from 1; 0: none. Empty without limbs.
std::vector<std::uint32_t> parts_by_limb(const MorphPlan& plan);

/// Parts of a plan whose balls were carried from where `reference` has them: each pair stays in its
/// part, and the alignments are fitted anew.
RigidParts carried_parts(const MorphPlan& plan, const MorphPlan& reference);

/// The graph of neighbouring balls, each edge as long as it should be at every time, and the solve
/// that puts the balls where their edges want them (Sorkine and Alexa 2007, "As-rigid-as-possible
/// surface modeling"): prefactored, so that a frame costs a few substitutions.
class BallGraph {
 public:
  /// `parts` as rigid_parts(plan) gave them.
  BallGraph(const MorphPlan& plan, const RigidParts& parts);
  /// The graph of carried balls, with the neighbours that they have in `reference`.
  BallGraph(const MorphPlan& plan, const RigidParts& parts, const BallGraph& reference);
  ~BallGraph();

  /// Places near `places` (one per pair, where their parts would have them) whose edges are nearest
  /// to what they should be: as long as (1-u) |p_e - p_f| + u |q_e - q_f|, turned as `turns`, which
  /// are fitted anew to what comes out, twice. With u = 0 (1) and the source's (target's)
  /// places, those. `progress`: u of each pair.
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
