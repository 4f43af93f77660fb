// An object's signed distances and what is measured on them, through the disk cache.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "field/distance_grid.h"
#include "kernels/engine.h"
#include "model/repair/shell.h"

namespace polymorph {

/// Raise it when signed_distances(), classify_faces(), thinness() or the measures give other
/// numbers: files of the cache made before are then not used. A test pins the digests.
inline constexpr std::uint32_t kDistancesVersion = 7;

struct ObjectDistances {
  std::vector<FaceSide> sides;  ///< one per triangle of the model
  double undecided = 0;         ///< undecided_share(); from kShellShare on it is taken for a shell
  std::shared_ptr<const DistanceGrid> grid;
  std::shared_ptr<const DistanceGrid> thinness;  ///< of a solid (field/thinness.h)
  double volume = 0;  ///< enclosed by the surface that cells of the asked size show
  double smallest_component_share = 1;  ///< share of that in its smallest part
  std::int64_t genus = 0;               ///< of that surface: how many handles it has
  std::string key;                      ///< a hash of everything that the distances depend on
};

inline bool is_shell(const ObjectDistances& object) { return object.undecided >= kShellShare; }

/// signed_distances() on half of `cell`, and of their surface on cells of that size the volume,
/// the smallest part and the genus, when parts below the share `min_part` are left out. From
/// `folder` where it is kept there; empty: no cache. `solidified`: of solidify(model). Of the
/// distances only what lies near the surface is stored, about 10 MB for a grid of 256^3. Errors:
/// the engine's.
Result<ObjectDistances> object_distances(const Model& model, const ClosestPointQuery& closest,
                                         float cell, float thinnest, double min_part,
                                         bool solidified, Engine& engine,
                                         const std::filesystem::path& folder);

}  // namespace polymorph
