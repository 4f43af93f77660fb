// Surfaces and balls as files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/mesh.h"
#include "kernels/types.h"

namespace polymorph {

/// A run of a mesh's triangles with a name, up to the next one's first.
struct MeshPart {
  std::string name;
  std::size_t first_triangle = 0;
};

/// Wavefront OBJ text with v, vn (none where the mesh is flat) and f, and an `o` line before each
/// part. Numbers read back to the same floats.
std::string encode_obj(const Mesh& mesh, std::span<const MeshPart> parts = {});
/// Binary little-endian PLY with positions, normals (none where the mesh is flat) and indices.
std::string encode_ply(const Mesh& mesh);
/// {"field": "gaussian", "balls": [{"center": [x, y, z], "a": .., "w": .., "radius": ..}, ...]}.
std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind);

/// The same as a table: x,y,z,a,w,radius and the six numbers of the shape.
std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind);

/// By extension: .obj or .ply. Errors: kUsage for another extension, kOutput when writing fails.
/// `parts`: for OBJ, in the order of their triangles.
Status write_mesh(const std::filesystem::path& path, const Mesh& mesh,
                  std::span<const MeshPart> parts = {});

}  // namespace polymorph
