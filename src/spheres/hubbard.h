// Sphere tree by merging the medial balls of a Voronoi diagram (Hubbard 1996).
#pragma once

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

/// Builds the sphere tree. The centres of its balls are those vertices of the surface samples'
/// Voronoi diagram that lie inside the model. Each sample is assigned to its pole (Amenta and Bern
/// 1999), the largest of the balls around its Voronoi cell's vertices. Samples without a pole, as
/// on parts thinner than the samples' spacing, are balls of radius 0. Then balls are merged in
/// pairs until `spheres` are left: each time, of the pairs adjacent in the diagram, the one whose
/// common ball protrudes least from the surface. Merging then continues to a single root.
/// This differs from Hubbard 1996 in two ways, which reduce the outside volume to a third
/// (measured). A merged ball keeps one of the two centres, whose distance from the surface is
/// known, instead of being the smallest ball around its samples. And a sample has to be covered
/// once, not by every ball around its cell's vertices.
/// The tree is the history of the merges. Its leaves are the `spheres` balls, or fewer if there are
/// not as many; each is shrunk to the samples that lie deepest in it. A node's level is its number
/// of steps from the root. Every cut through the tree covers every sample. Errors (kInput): no
/// vertex lies inside (the model is open, flat or thinner than the samples' spacing); the message
/// says what to do.
Result<SphereTree> build_hubbard_tree(const Model& model, const InsideTest& test,
                                      const HubbardSettings& settings);

}  // namespace polymorph
