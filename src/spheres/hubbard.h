// Sphere tree by merging the medial balls of a Voronoi diagram (Hubbard 1996).
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/result.h"
#include "mesh/inside.h"
#include "model/model.h"
#include "spheres/spheres.h"

namespace polymorph {

struct HubbardSettings {
  int spheres = 64;        ///< number of leaves, >= 1
  int samples = 0;         ///< number of surface samples; 0 = choose_hubbard_samples(spheres)
  std::uint64_t seed = 0;  ///< seed of sample_surface()
};

/// Number of surface samples: 16 per sphere, 4000 to 40000.
int choose_hubbard_samples(int spheres);

/// Builds the sphere tree. Vertices of the surface samples' Voronoi diagram that lie inside the
/// model are centres of balls. A sample belongs to the largest ball that it forms (Amenta's pole);
/// samples without one, as on parts thinner than the samples' spacing, are balls of radius 0. Then
/// the pair of balls adjacent in the diagram whose common ball protrudes least from the surface is
/// merged, repeatedly, until `spheres` are left. This differs from Hubbard 1996 in two ways, which
/// reduce the outside volume to a third (measured): a merged ball keeps one of the two centres,
/// whose distance from the surface is known, instead of being the smallest ball around its samples;
/// and a sample has to be covered once, not by every ball that it forms. Merging then continues to
/// one root. The tree is the history of the merges. Its leaves are the `spheres` balls, each shrunk
/// to the samples that lie deepest in it; a node's level is its number of steps from the root.
/// Every cut through the tree covers every sample. There are `spheres` leaves, or fewer if there
/// are fewer balls. Errors (kInput): no vertex lies inside (the model is open, flat or thinner than
/// the samples' spacing); the message says what to do.
Result<SphereTree> build_hubbard_tree(const Model& model, const InsideTest& test,
                                      const HubbardSettings& settings);

}  // namespace polymorph
