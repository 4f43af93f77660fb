// Surfaces as Wavefront OBJ files with materials.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interchange/material_catalog.h"
#include "interchange/surface_frame.h"

namespace polymorph {

/// OBJ text: an `o` line for each actor, `v` with the point's colour behind it (sRGB, 0..1, as most
/// programs take it), vt, vn and f. Numbers read back to the same floats. With `library` the faces
/// name their materials, which are taken into the catalogue, and the file names that MTL.
std::string encode_obj(std::span<const SurfaceFrame> frames, const SurfaceSequence& sequence,
                       const std::string& library, MaterialCatalog& catalog);

/// The catalogue as an MTL: Kd, Ks, Ns, Pr, Pm, d, Ni and map_Kd, which names texture k by
/// `texture_names[k]`.
std::string encode_mtl(const MaterialCatalog& catalog,
                       const std::vector<std::string>& texture_names);

}  // namespace polymorph
