// Correspondences in the disk cache: the parts of plans that take long to compute.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "morph/plan.h"

namespace polymorph {

/// Version of the cached correspondences. Raise it when the same sides and settings yield another
/// Correspondence; stored ones are then ignored. A test pins the digests.
inline constexpr std::uint32_t kPlanVersion = 10;

/// The members of a plan that depend on its sides and settings only and are slow to compute.
struct Correspondence {
  std::vector<double> from_masses, to_masses;  ///< masses of the balls, as in MorphPlan
  std::vector<Pair> pairs;
  Mat3 rotation;                                   ///< rotation of `from` in the alignment
  std::vector<std::int32_t> from_limbs, to_limbs;  ///< MorphPlan::from_limbs, to_limbs
  LimbCurves from_curves, to_curves;               ///< MorphPlan::from_curves, to_curves
  std::vector<std::pair<std::string, std::string>> limb_names;  ///< MorphPlan::limb_names
};

/// Hashes everything that a correspondence depends on.
std::string correspondence_key(const PlanSide& from, const PlanSide& to, FieldKind kind,
                               const PlanSettings& settings);

/// Loads the correspondence that is stored in `folder` under `key`, bit for bit; nullopt if there
/// is none or it does not fit the sides.
std::optional<Correspondence> load_correspondence(const std::filesystem::path& folder,
                                                  const std::string& key, const PlanSide& from,
                                                  const PlanSide& to);
/// Stores a correspondence. `origin`: the names of its sides (base/cache_file.h).
void store_correspondence(const std::filesystem::path& folder, const std::string& key,
                          std::string_view origin, const Correspondence& correspondence);

}  // namespace polymorph
