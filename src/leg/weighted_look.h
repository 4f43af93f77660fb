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

/// Computes the weight of each object in a mixture's colours from the objects' weights in the
/// mixture; the sum is 1. With two objects, the second object's weight is ColorFade::color
/// (leg/surface_look.h).
std::vector<float> color_shares(std::span<const float> weights);

/// The positions of a mixture's surface points on each of its objects.
struct PulledMixture {
  const Mixture& mixture;                 ///< borrowed
  std::vector<std::vector<Vec3>> places;  ///< [object of the mixture][surface point]
  /// Origins::closest (model/transfer.h) of the object with the largest weight; empty until
  /// blend_weighted_normals() sets it.
  std::vector<ClosestPoint> closest;
};
/// Maps the surface's points to all objects of the mixture. Errors: the engine's.
Result<PulledMixture> pull_mixture_back(const Mixture& mixture, const WeightedSurface& surface,
                                        Engine& engine);

/// Computes the mixture's own look. If one object has nearly all the weight, the look has that
/// object's detail; otherwise it mixes the objects' colours without detail.
SurfaceLook weighted_look(const PulledMixture& pulled, std::span<const Triangle> triangles);

/// If one object has nearly all the weight, mixes its model's normals into the surface's
/// (add_end_normals()) and sets pulled.closest.
void blend_weighted_normals(PulledMixture& pulled, Mesh& surface);

/// Returns the label of each point, as an index into the actor's label_names: the label of the
/// point's position on the object with the largest weight.
std::vector<std::uint32_t> weighted_labels(const PulledMixture& pulled);

}  // namespace polymorph
