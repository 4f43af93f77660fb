// Model from a mesh in memory (scene/memory_models.h).
#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/load/load_obj.h"
#include "scene/memory_models.h"

namespace polymorph {

/// Makes a model of a mesh as if it came from an OBJ file: load_obj() says what is done to it.
/// `path` is its name in messages, where a number behind it is that of a face, counted from 0.
/// Errors (kInput): a face with fewer than 3 corners or more than 4096, a vertex that is not there
/// or beyond +-1e15, colours of another number than the vertices, no face with an area.
Result<LoadedModel> load_memory(const MemoryMesh& mesh, const std::filesystem::path& path,
                                const LoadObjSettings& settings = {});

}  // namespace polymorph
