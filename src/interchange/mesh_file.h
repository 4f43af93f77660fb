// A plain mesh as a file.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "kernels/mesh.h"

namespace polymorph {

/// Positions, normals (none where the mesh is flat) and triangles, by extension: .obj or .ply.
/// Errors: kUsage for another extension, kOutput when writing fails.
Status write_mesh(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace polymorph
