// Hubbard's sphere tree (1996): spheres by merging the medial balls of a Voronoi diagram.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/result.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "spheres/spheres.h"

namespace polymorph {

struct HubbardSettings {
  int spheres = 64;        ///< >= 1: how many leaves
  int samples = 0;         ///< surface samples; 0 = hubbard_samples(spheres)
  std::uint64_t seed = 0;  ///< of the samples: sample_surface(model, samples, seed)
};

/// 4000, or 16 per sphere if that is more, up to 40000.
int hubbard_samples(int spheres);

/// Samples the surface; vertices of the samples' Voronoi diagram that lie inside the model are
/// centres of balls. A sample belongs to the largest ball that it forms (Amenta's pole); samples
/// without one, as on parts thinner than the samples are apart, are balls of no radius. Then the
/// two balls, adjacent in the diagram, are merged whose ball around all their samples stands out
/// above the surface the least, until `spheres` are left. Two things differ from Hubbard 1996, and
/// make the outside volume a third of what it was (measured): a merged ball stays around one of the
/// two centres, where nothing is nearer than the surface, instead of being the smallest around its
/// samples; and a sample has to be covered once, not by every ball that it forms.
/// Merging goes on to one root: the tree is that history, its leaves the spheres that were left,
/// each shrunk to the samples that lie deepest in it; level = steps from the root.
/// Every cut through the tree covers every sample, so the leaves do. There are `spheres` leaves, or
/// fewer if there are fewer balls. Errors (kInput): no vertex lies inside (the model is open, flat
/// or thinner than the samples are apart), with what to do.
Result<SphereTree> hubbard_spheres(const Model& model, const InsideTest& test,
                                   const HubbardSettings& settings);

}  // namespace polymorph
