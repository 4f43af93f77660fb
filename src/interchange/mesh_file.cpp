#include "interchange/mesh_file.h"

#include "base/file.h"
#include "interchange/obj.h"
#include "interchange/ply.h"

namespace polymorph {

Status write_mesh(const std::filesystem::path& path, const Mesh& mesh) {
  SurfaceFrame frame;
  frame.positions = mesh.positions;
  frame.normals = mesh.normals;
  frame.triangles = mesh.triangles;
  MaterialCatalog none;
  if (path.extension() == ".obj")
    return write_file(path, encode_obj({&frame, 1}, /*sequence=*/{}, /*library=*/"", none));
  if (path.extension() == ".ply") return write_file(path, encode_ply({&frame, 1}, /*sequence=*/{}));
  return make_error(ErrorCode::kUsage, "{}: unknown mesh format \"{}\" - use .obj or .ply",
                    path.string(), path.extension().string());
}

}  // namespace polymorph
