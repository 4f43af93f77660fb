// Surfaces as Wavefront OBJ files with materials.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interchange/material_catalog.h"
#include "interchange/surface_frame.h"

namespace polymorph {

/// Encodes OBJ text: an `o` line per actor, `v` followed by the point's colour (sRGB, 0..1, as most
/// programs read it), vt, vn and f. Numbers other than colours read back to the same floats. If
/// `library` is not empty, the file refers to the MTL file of this name and its faces to materials,
/// which are added to the catalogue. `frames` has one surface per actor.
std::string encode_obj(std::span<const SurfaceFrame> frames, const SurfaceSequence& sequence,
                       const std::string& library, MaterialCatalog& catalog);

/// Encodes the catalogue as an MTL: Kd, Ks, Ns, Pr, Pm, d and Ni of transparent materials, and
/// map_Kd, which names texture k by `texture_names[k]`.
std::string encode_mtl(const MaterialCatalog& catalog,
                       const std::vector<std::string>& texture_names);

}  // namespace polymorph
