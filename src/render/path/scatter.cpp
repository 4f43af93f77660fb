#include "render/path/scatter.h"

namespace polymorph {

// The packs' instantiations, compiled once here (extern in scatter.h) instead of in each file that
// includes it.
template PackMask scatter_on_floor(const World&, Vertices&, const FloorPointOf<Pack3>&,
                                   const VertexRandom&, RayStats&);
template PackMask scatter_on_mesh(const World&, Vertices&, const SurfacePointOf<Pack3>&,
                                  const BsdfOf<Pack3>&, const VertexRandom&);

}  // namespace polymorph
