// Picture of a sphere approximation: the model, its spheres and the balls' surface side by side.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "kernels/mesh.h"
#include "model/model.h"
#include "spheres/spheres.h"

namespace polymorph {

/// Makes one mesh of all spheres, with 320 triangles per sphere.
Mesh make_sphere_mesh(const std::vector<Sphere>& spheres);

/// Renders model, spheres and surface from one camera, each `width` pixels wide, side by side into
/// a PNG or EXR. The spheres have alternating colours. Errors: kResource (Embree), kOutput
/// (writing).
Status write_spheres_picture(const std::filesystem::path& path, const Model& model,
                             const std::vector<Sphere>& spheres, const Mesh& surface, int width);

}  // namespace polymorph
