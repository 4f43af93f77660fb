#include "render/path/path.h"

namespace polymorph {

template Pack3 clamp_indirect(const World&, const Paths&, const Pack3&);
template void add_sky(const World&, Paths&, Pack, PackMask);
template void add_hit_lamps(const World&, Paths&, Pack, PackMask);
template void leave_scene(const World&, Paths&, PackMask);

}  // namespace polymorph
