// Model construction from a scanned OBJ file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "model/load/mtl.h"
#include "model/load/obj_scan.h"
#include "model/model.h"

namespace polymorph {

/// Builds a model: welds points, drops faces without area, triangulates, computes missing normals,
/// maps materials (textures are loaded later) and flips faces that are oriented wrongly
/// (model/repair/orient.h; a warning gives their number). `vertices`, if not null, is set to the
/// file's vertices in their order, before welding. Errors (kInput): no face with an area.
Result<Model> build_model(ObjScan& scan, const MtlSet& mtls, const std::filesystem::path& path,
                          std::vector<std::string>& warnings,
                          std::vector<Vec3>* vertices = nullptr);

}  // namespace polymorph
