// Look of a mixture of several objects: their materials, colours and normals by their weights.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/surface_look.h"
#include "leg/weighted_surface.h"

namespace polymorph {

/// Share of each object in a mixture's colours; their sum is 1. Of two objects those of
/// color_fade().
std::vector<float> color_shares(std::span<const float> weights);

/// The surface of a mixture with the places of its points on the objects.
struct PulledMixture {
  const Mixture& mixture;                 ///< borrowed
  std::vector<std::vector<Vec3>> places;  ///< one list per object of the mixture
  /// Closest points of the object with the largest weight, as in Origins.
  std::vector<ClosestPoint> closest;
};
/// Errors: the engine's.
Result<PulledMixture> pull_mixture_back(const Mixture& mixture, const WeightedSurface& surface,
                                        Engine& engine);

/// The mixture's own look: detail of an object that has nearly all the weight, else the objects'
/// colours without detail, mixed.
SurfaceLook weighted_look(const PulledMixture& pulled, std::span<const Triangle> triangles);

/// Mixes the normals of an object that has nearly all the weight into those of the surface, and
/// keeps the closest points that it finds.
void blend_weighted_normals(PulledMixture& pulled, Mesh& surface);

/// Label of each point, as an index into the actor's names: that of the object with the largest
/// weight, where the point is on it.
std::vector<std::uint32_t> weighted_labels(const PulledMixture& pulled);

}  // namespace polymorph
