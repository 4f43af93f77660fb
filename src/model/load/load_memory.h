// Model from a mesh in memory (scene/memory_models.h).
#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/load/load_obj.h"
#include "scene/memory_models.h"

namespace polymorph {

/// Makes a model of a mesh as if it came from an OBJ file (load_obj()). Messages call the mesh
/// `path`, and give the index of a face, from 0, where they would give the line of an OBJ file.
/// Errors (kInput): a face with fewer than 3 corners or more than 4096, a vertex index out of
/// range, a coordinate beyond +-1e15, numbers of colours and vertices that differ, no face with an
/// area.
Result<LoadedModel> load_memory(const MemoryMesh& mesh, const std::filesystem::path& path,
                                const LoadObjSettings& settings = {});

}  // namespace polymorph
