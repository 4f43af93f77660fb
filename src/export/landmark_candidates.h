// Landmark candidates: the tips of limbs. Matched tips have the same name.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "interchange/landmarks_page.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// The objects of a leg and the tips of their limbs.
struct LegCandidates {
  int actor = 0;                 ///< index of the actor in the scene
  int from = 0, to = 0;          ///< indices of the actor's objects
  std::string from_key, to_key;  ///< landmark_key() of both objects
  struct Tip {
    std::string name;  ///< name of the limb
    /// Points of both surfaces, in each file's coordinates; one is empty if the limb is unmatched.
    std::optional<Vec3> from, to;
  };
  /// Matched tips first. The limbs of an object have the same names in both of its legs.
  std::vector<Tip> tips;
};

/// Returns the name of an object in the scene's plan.landmarks: the name of its file, or the
/// object's own name if it has no file or another file of the scene has the same name.
std::string landmark_key(const Scene& scene, const ObjectSettings& object);

/// Lists the legs that begin at an object, in order, with the tips of the limbs that find_limbs()
/// finds. Leaves out legs that begin with the moving balls of an earlier leg. Errors (kInput):
/// an object is flattened by its scale.
Result<std::vector<LegCandidates>> landmark_candidates(const PreparedScene& prepared);

/// Returns the pairs of matched tips with the names of their limbs.
std::vector<NamedPair> matched_tips(const LegCandidates& leg);

}  // namespace polymorph
