// Models in memory: meshes in a caller's arrays, under virtual paths that a scene names like files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "kernels/types.h"

namespace polymorph {

/// A caller's mesh of polygons, whose geometry is not checked yet.
struct MemoryMesh {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> corners;     ///< indices into `vertices`, face after face
  std::vector<std::uint32_t> face_sizes;  ///< number of corners of each face
  std::vector<float> colors;              ///< 3 per vertex: sRGB in [0, 1]; empty: no colours
};

/// Meshes that scenes may name while this object lives. Their paths are unique in the process and
/// are never those of files.
class MemoryModels {
 public:
  MemoryModels();
  ~MemoryModels();
  MemoryModels(const MemoryModels&) = delete;
  MemoryModels& operator=(const MemoryModels&) = delete;

  /// Adds a mesh. Returns its path, whose stem is `name`.
  std::filesystem::path add(const std::string& name, MemoryMesh mesh);
  /// Adds a mesh sequence, numbered from 1. Returns its path with #### for the number.
  std::filesystem::path add(const std::string& name, std::vector<MemoryMesh> meshes);

 private:
  std::filesystem::path folder_;
};

/// The mesh in memory under this path; null if there is none.
std::shared_ptr<const MemoryMesh> find_memory_mesh(const std::filesystem::path& path);

/// Tests whether a path names a model: in memory, a file, or a pose of an animated model.
bool model_exists(const std::filesystem::path& path);

}  // namespace polymorph
