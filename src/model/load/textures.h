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

/// Inputs of load_textures(): they name the textures of a model.
struct TextureSources {
  const std::filesystem::path& obj;
  const ObjScan& scan;
  const MtlSet& mtls;
  /// Files contained in the model, by the names that the materials use.
  const std::map<std::string, std::string>& embedded;
};

/// Reads each texture that a triangle uses, once, and sets Material::texture. A texture that is
/// missing, broken, outside the model's folder or contains NaN causes a warning, and its material
/// becomes a default grey; with `strict`, all these warnings form one error (kInput) instead. Each
/// message names the MTL and its line. Other errors (kResource): no image reader.
Status load_textures(const TextureSources& textures, bool strict, Model& model,
                     std::vector<std::string>& warnings);

}  // namespace polymorph
