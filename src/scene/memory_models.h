// Models in memory: meshes that a caller has as arrays, under paths by which a scene has them as if
// they were files.
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

/// A mesh as a caller has it: polygons over vertices, in any order, not yet checked for their
/// geometry.
struct MemoryMesh {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> corners;     ///< indices into `vertices`, face after face
  std::vector<std::uint32_t> face_sizes;  ///< number of corners of each face
  std::vector<float> colors;              ///< 3 per vertex: sRGB in [0, 1]; or empty
};

/// Meshes that scenes may name, for its lifetime. The paths are the process's, unlike those of any
/// file and of any other owner.
class MemoryModels {
 public:
  MemoryModels();
  ~MemoryModels();
  MemoryModels(const MemoryModels&) = delete;
  MemoryModels& operator=(const MemoryModels&) = delete;

  /// Adds a mesh. Returns its path, whose stem is `name`.
  std::filesystem::path add(const std::string& name, MemoryMesh mesh);
  /// Adds a mesh sequence. Returns its path, with #### in the place of the numbers from 1.
  std::filesystem::path add(const std::string& name, std::vector<MemoryMesh> meshes);

 private:
  std::filesystem::path folder_;
};

/// The mesh that is in memory under this path; null if there is none.
std::shared_ptr<const MemoryMesh> find_memory_mesh(const std::filesystem::path& path);

/// Tests whether there is a model of this path: in memory, as a file, or as a pose of one.
bool model_exists(const std::filesystem::path& path);

}  // namespace polymorph
