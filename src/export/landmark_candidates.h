// Candidates of landmarks: the tips of limbs, matched ones by one name.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "interchange/landmarks_page.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// A leg's objects as plan.landmarks calls them, and tips of their limbs.
struct LegCandidates {
  int actor = 0;
  int from = 0, to = 0;  ///< indices of the actor's objects
  std::string from_key, to_key;
  struct Tip {
    std::string name;
    std::optional<Vec3> from, to;  ///< places on the surface, in each file's coordinates
  };
  std::vector<Tip> tips;  ///< matched ones first; an object on the way keeps its limbs' names
};

/// Name of an object in plan.landmarks: its file's, or its own where another object of the scene
/// has a file of that name.
std::string landmark_key(const Scene& scene, const ObjectSettings& object);

/// The legs between objects that are reached, in order, with the tips that find_limbs() sees.
/// Errors (kInput): an object that its scale flattens.
Result<std::vector<LegCandidates>> landmark_candidates(const PreparedScene& prepared);

/// The matched ones.
std::vector<NamedPair> matched_tips(const LegCandidates& leg);

}  // namespace polymorph
