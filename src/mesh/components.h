// Connected components of a mesh: removal of small ones.
#pragma once

#include <cstddef>

#include "kernels/mesh.h"

namespace polymorph {

/// Small components that together enclose more than `share` of the volume are a heap: only those
/// below `fraction` of it are removed. By default there is no heap.
struct HeapLimit {
  double share = 1, fraction = 0;
};

/// Removes the connected components that enclose less than `fraction` of the whole mesh's volume,
/// unless they are a heap; cavities count as components. The others keep their order, and the
/// largest always stays. A surface of balls sheds such components where two balls separate. Returns
/// how many were removed.
std::size_t remove_small_components(Mesh& mesh, double fraction, HeapLimit heap = {});

/// The fraction of the whole mesh's volume that all components together enclose which are each
/// below `fraction` of it, [0, 1].
double small_components_share(const Mesh& mesh, double fraction);

/// The fraction of the whole mesh's volume that its smallest component encloses, [0, 1].
double smallest_component_share(const Mesh& mesh);

}  // namespace polymorph
