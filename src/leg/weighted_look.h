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

/// Computes the weight of each object in a mixture's colours; the sum is 1. For two objects the
/// weights are those of color_fade().
std::vector<float> color_shares(std::span<const float> weights);

/// The positions of a mixture's surface points on each of its objects.
struct PulledMixture {
  const Mixture& mixture;                 ///< borrowed
  std::vector<std::vector<Vec3>> places;  ///< one list per object of the mixture
  /// Closest points of the object with the largest weight, as in Origins.
  std::vector<ClosestPoint> closest;
};
/// Maps the surface's points to all objects of the mixture. Errors: the engine's.
Result<PulledMixture> pull_mixture_back(const Mixture& mixture, const WeightedSurface& surface,
                                        Engine& engine);

/// Computes the mixture's own look: if one object has nearly all the weight, with that object's
/// detail; else the mixed colours of the objects without detail.
SurfaceLook weighted_look(const PulledMixture& pulled, std::span<const Triangle> triangles);

/// Mixes the model's own normals into those of the surface if one object has nearly all the weight,
/// and keeps the closest points that it finds.
void blend_weighted_normals(PulledMixture& pulled, Mesh& surface);

/// Returns the label of each point, as an index into the actor's names: the label of its position
/// on the object with the largest weight.
std::vector<std::uint32_t> weighted_labels(const PulledMixture& pulled);

}  // namespace polymorph
