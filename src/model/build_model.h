// Model construction from a scanned OBJ file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model/model.h"
#include "model/mtl.h"
#include "model/obj_scan.h"

namespace polymorph {

/// Welds points, drops faces without area, triangulates, computes missing normals, maps materials
/// (textures come later), and turns faces that look the wrong way (model/orient.h; a warning says
/// how many). Frees `scan.text`. Errors (kInput): nothing left.
Result<Model> build_model(ObjScan& scan, const MtlSet& mtls, const std::filesystem::path& path,
                          std::vector<std::string>& warnings);

}  // namespace polymorph
