// Texture loading: the images that a model's materials name.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "model/load/mtl.h"
#include "model/load/obj_scan.h"
#include "model/model.h"

namespace polymorph {

/// Reads each texture that a triangle uses, once, and sets Material::texture. One that is missing,
/// broken, outside the model's folder or has NaN in it is a warning, and the material a default
/// grey; with `strict` all of them are one error (kInput). Each names the MTL and its line. Errors
/// besides (kResource): no reader.
/// `embedded`: files in the model's own, by the names that the materials use.
Status load_textures(const std::filesystem::path& obj, const ObjScan& scan, const MtlSet& mtls,
                     bool strict, Model& model, std::vector<std::string>& warnings,
                     const std::map<std::string, std::string>& embedded = {});

}  // namespace polymorph
