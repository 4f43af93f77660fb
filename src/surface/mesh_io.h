// Mesh export (OBJ, PLY) and ball files (JSON, CSV).
#pragma once

#include <cstdint>
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

/// What a mesh file can say beside the surface.
struct MeshTags {
  std::vector<MeshPart> parts;        ///< in the order of their triangles
  std::vector<std::uint32_t> labels;  ///< one per vertex: index into label_names; or empty
  std::vector<std::string> label_names;
};

/// Wavefront OBJ text with v, vn (none where the mesh is flat) and f, and an `o` line before each
/// part. Numbers read back to the same floats.
std::string encode_obj(const Mesh& mesh, std::span<const MeshPart> parts = {});
/// Binary little-endian PLY with positions, normals (none where the mesh is flat) and indices; with
/// labels also an int `label` a vertex, whose names stand in comments: "comment label 0 beak".
std::string encode_ply(const Mesh& mesh, const MeshTags& tags = {});
/// {"field": "gaussian", "balls": [{"center": [x, y, z], "a": .., "w": .., "radius": ..}, ...]}.
std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind);

/// The same as a table: x,y,z,a,w,radius and the six numbers of the shape.
std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind);

/// By extension: .obj (with its parts) or .ply (with its labels). Errors: kUsage for another
/// extension, kOutput when writing fails.
Status write_mesh(const std::filesystem::path& path, const Mesh& mesh, const MeshTags& tags = {});

}  // namespace polymorph
