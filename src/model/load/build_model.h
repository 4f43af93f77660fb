// Model construction from a scanned OBJ file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model/load/mtl.h"
#include "model/load/obj_scan.h"
#include "model/model.h"

namespace polymorph {

/// Welds points, drops faces without area, triangulates, computes missing normals, maps materials
/// (textures come later), and turns faces that look the wrong way (model/repair/orient.h; a warning
/// says how many). Frees `scan.text`. Errors (kInput): nothing left.
Result<Model> build_model(ObjScan& scan, const MtlSet& mtls, const std::filesystem::path& path,
                          std::vector<std::string>& warnings);

}  // namespace polymorph
