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

/// The sources of a model's textures.
struct TextureNames {
  const std::filesystem::path& obj;
  const ObjScan& scan;
  const MtlSet& mtls;
  /// Files contained in the model, by the names that the materials use.
  const std::map<std::string, std::string>& embedded;
};

/// Reads each texture that a triangle uses, once, and sets Material::texture. One that is missing,
/// broken, outside the model's folder or contains NaN causes a warning, and the material becomes a
/// default grey; with `strict` all of these form one error (kInput). Each message names the MTL and
/// its line. Other errors (kResource): no image reader.
Status load_textures(const TextureNames& textures, bool strict, Model& model,
                     std::vector<std::string>& warnings);

}  // namespace polymorph
