// Picture of a sphere approximation: the model, its spheres and the balls' surface side by side.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "kernels/mesh.h"
#include "model/model.h"
#include "spheres/spheres.h"

namespace polymorph {

/// The spheres as one mesh, 320 triangles each.
Mesh mesh_of_spheres(const std::vector<Sphere>& spheres);

/// Renders the three from one camera, `width` pixels each, into a PNG or EXR. The spheres are
/// coloured one by one. Errors: kResource (Embree), kOutput (writing).
Status write_spheres_picture(const std::filesystem::path& path, const Model& model,
                             const std::vector<Sphere>& spheres, const Mesh& surface, int width);

}  // namespace polymorph
