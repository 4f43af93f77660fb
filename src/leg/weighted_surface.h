// Weighted mixture of several objects (a barycentre of shapes; the idea of Solomon et al. 2015):
// the surface where the weighted sum of their distances is zero.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "kernels/engine.h"
#include "leg/leg.h"

namespace polymorph {

/// Objects that can be mixed: a reference, and legs from it to each of the others. All maps go
/// through the reference, so that from one object over a second to a third is the direct way.
struct ShapeSpace {
  std::vector<std::shared_ptr<const Leg>> legs;  ///< one or more, from one object, of distances
};

/// Index of the object that the others' plans should start from, by what its distances are made of
/// (ObjectDistances::key): any order of the same objects has the same reference. One or more.
std::size_t choose_reference(std::span<const std::shared_ptr<const PreparedObject>> objects);

/// The surface of the mixture. `weights`: that of the reference, then one per leg, in [0, 1], whose
/// sum is 1. The reference's balls are carried to the weighted mean of their places on all objects
/// (rotations and scalings of the whole by their logarithms); regressions around them pull each
/// object's distances back, and their sum has the level that keeps the weighted mean of the
/// volumes. A weight of 1 gives that object's own distances. The result depends neither on the
/// order of legs whose weights are 0 nor on the number of threads. Errors: kInput for weights that
/// are no such and objects without an inside (shells and vessels); kResource.
Result<Mesh> weighted_surface(const ShapeSpace& space, std::span<const float> weights,
                              Engine& engine);

}  // namespace polymorph
