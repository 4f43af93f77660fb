#include "interchange/surface_frame.h"

namespace polymorph {

bool same_material(const SurfaceMaterial& a, const SurfaceMaterial& b) {
  return a.color == b.color && a.texture == b.texture && a.roughness == b.roughness &&
         a.metallic == b.metallic && a.transmission == b.transmission && a.ior == b.ior;
}

}  // namespace polymorph
