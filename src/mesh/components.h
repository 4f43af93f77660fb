// Connected components of a mesh: removal of small ones.
#pragma once

#include <cstddef>

#include "kernels/mesh.h"

namespace polymorph {

/// Exception of remove_small_components() for meshes that consist of many small objects: if the
/// components to be removed together enclose more than `share` of the mesh's volume, only those
/// below `fraction` of the volume are removed. By default there is no exception.
struct ManyComponentsLimit {
  double share = 1, fraction = 0;
};

/// Removes the connected components that enclose less than `fraction` of the mesh's volume; `limit`
/// may lower that fraction. Cavities count as components. The other components keep their order,
/// and the largest always stays. An implicit surface of balls has such small components where two
/// balls separate. Returns the number of removed components.
std::size_t remove_small_components(Mesh& mesh, double fraction, ManyComponentsLimit limit = {});

/// Counts the connected components; a point without triangles is one.
std::size_t count_components(const Mesh& mesh);

/// Fraction, in [0, 1], of the mesh's volume that its smallest component encloses; 0 if the mesh
/// encloses none.
double smallest_component_share(const Mesh& mesh);

}  // namespace polymorph
