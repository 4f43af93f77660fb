// Wavefront OBJ loader, with MTL materials and textures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/model.h"

namespace polymorph {

struct LoadObjSettings {
  std::uint64_t max_bytes = 2ull << 30;  ///< maximum size of the model's file
  bool textures = true;                  ///< false: geometry and materials only (check, spheres)
  bool strict = false;  ///< a missing MTL and a missing or broken texture are errors, not warnings
  bool vertices = false;  ///< return the file's own vertices, too
};

struct LoadedModel {
  Model model;
  std::vector<std::string> warnings;  ///< "FILE:LINE: problem - consequence"
  std::uint32_t file_points = 0;  ///< v lines; the model keeps only distinct points that faces use
  std::vector<Vec3> vertices;     ///< all vertices in the file's order, if requested
};

/// Loads a Wavefront OBJ. Every bad number, index or file is an error with FILE:LINE (up to 20 at
/// once). Points at equal positions are merged, in the file's order. Faces are triangulated by ear
/// clipping; faces without area are dropped with a warning. Where a face has no normals of its own,
/// they are computed, smooth up to kCreaseDegrees (smoothing groups are ignored). Faces that are
/// oriented wrongly are flipped (model/repair/orient.h). Labels are group names, or object names
/// where there is no group. Materials: model/load/mtl.h. Textures: model/load/textures.h. Errors:
/// kInput, also for MTLs outside the model's folder.
Result<LoadedModel> load_obj(const std::filesystem::path& path,
                             const LoadObjSettings& settings = {});

}  // namespace polymorph
