#include "render/materials/materials.h"

namespace polymorph {

template BsdfOf<Pack3> make_bsdf(const ShadingOf<Pack3>&, const ShadingOf<Pack3>&, Pack,
                                 const Pack3&, const Pack3&);
template BsdfValueOf<Pack3> evaluate_bsdf(const BsdfOf<Pack3>&, const Pack3&);
template Pack3 sample_bsdf(const BsdfOf<Pack3>&, Pack, Pack);

}  // namespace polymorph
