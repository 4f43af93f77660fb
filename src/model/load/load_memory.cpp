#include "model/load/load_memory.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "model/load/build_model.h"
#include "model/load/obj_scan.h"

namespace polymorph {
namespace {

Status check_vertices(const MemoryMesh& mesh, const std::string& file) {
  constexpr float kMaxCoordinate = 1e15f;  // as in OBJ files (text_lines.cpp)
  if (mesh.vertices.size() > std::numeric_limits<std::int32_t>::max())
    return make_error(ErrorCode::kInput, "{}: has {} vertices - use a smaller mesh", file,
                      mesh.vertices.size());
  if (!mesh.colors.empty() && mesh.colors.size() != 3 * mesh.vertices.size())
    return make_error(ErrorCode::kInput, "{}: has {} vertices and {} colours", file,
                      mesh.vertices.size(), mesh.colors.size() / 3);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3 v = mesh.vertices[i];
    for (const float c : {v.x, v.y, v.z})
      if (!(std::abs(c) <= kMaxCoordinate))
        return make_error(ErrorCode::kInput,
                          "{}: vertex {} has the coordinate {} - use values within +-1e15", file, i,
                          c);
  }
  return Ok{};
}

Status check_faces(const MemoryMesh& mesh, const std::string& file) {
  const std::size_t corners =
      std::accumulate(mesh.face_sizes.begin(), mesh.face_sizes.end(), std::size_t{0});
  if (corners != mesh.corners.size())
    return make_error(ErrorCode::kInput, "{}: its faces need {} corners, there are {}", file,
                      corners, mesh.corners.size());
  if (mesh.face_sizes.empty()) return make_error(ErrorCode::kInput, "{}: no faces", file);
  std::size_t corner = 0;
  for (std::size_t f = 0; f < mesh.face_sizes.size(); ++f) {
    if (mesh.face_sizes[f] < 3 || mesh.face_sizes[f] > kMaxFaceCorners)
      return make_error(ErrorCode::kInput, "{}: face {} has {} corners - use 3 to {}", file, f,
                        mesh.face_sizes[f], kMaxFaceCorners);
    for (std::uint32_t k = 0; k < mesh.face_sizes[f]; ++k, ++corner)
      if (mesh.corners[corner] >= mesh.vertices.size())
        return make_error(ErrorCode::kInput, "{}: face {} uses vertex {}, but there are {}", file,
                          f, mesh.corners[corner], mesh.vertices.size());
  }
  return Ok{};
}

/// Converts the mesh to the form of a scanned file.
ObjScan to_scan(const MemoryMesh& mesh) {
  ObjScan scan;
  scan.labels = {"default"};
  for (const Vec3 v : mesh.vertices) scan.positions.insert(scan.positions.end(), {v.x, v.y, v.z});
  for (const std::uint32_t size : mesh.face_sizes) {
    ObjFace& face = scan.faces.emplace_back();
    face.corners = size;
    // Messages name the face's index in place of a line.
    face.line = static_cast<std::uint32_t>(scan.faces.size()) - 1;
  }
  scan.corners.resize(mesh.corners.size());
  for (std::size_t i = 0; i < scan.corners.size(); ++i)
    scan.corners[i].v = static_cast<std::int32_t>(mesh.corners[i]);
  color_faces(scan, mesh.colors);
  return scan;
}

}  // namespace

Result<LoadedModel> load_memory(const MemoryMesh& mesh, const std::filesystem::path& path,
                                const LoadObjSettings& settings) {
  PM_TRY_STATUS(check_vertices(mesh, path.string()));
  PM_TRY_STATUS(check_faces(mesh, path.string()));
  ObjScan scan = to_scan(mesh);
  LoadedModel loaded;
  loaded.file_points = scan.point_count();
  PM_TRY(loaded.model, build_model(scan, MtlSet{}, path, loaded.warnings,
                                   settings.vertices ? &loaded.vertices : nullptr));
  return loaded;
}

}  // namespace polymorph
