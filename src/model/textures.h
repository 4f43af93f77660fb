// The images that a model's materials name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model/model.h"
#include "model/mtl.h"
#include "model/obj_scan.h"

namespace polymorph {

/// The entry of `mtls` that a usemtl name means; null if there is none.
const MtlMaterial* find_material(const MtlSet& mtls, const std::string& name);

/// Reads each texture that a triangle uses, once, and sets Material::texture. Errors (kInput):
/// missing, broken, outside the model's folder, NaN in it; each names the MTL and its line.
Status load_textures(const std::filesystem::path& obj, const ObjScan& scan, const MtlSet& mtls,
                     Model& model, std::vector<std::string>& warnings);

}  // namespace polymorph
