// Writing of a mesh without materials to a file.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "kernels/mesh.h"

namespace polymorph {

/// Writes positions, normals (unless the mesh has none) and triangles as OBJ or PLY, chosen by the
/// extension of `path`. Errors: kUsage for another extension, kOutput if writing fails.
Status write_mesh(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace polymorph
