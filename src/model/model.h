// Model type: an input polyhedron with the materials and texture coordinates that shade it. The
// extracted surface is a `Mesh` (kernels/mesh.h).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "image/texture.h"
#include "mesh/mesh_view.h"

namespace polymorph {

/// Marks a missing index in lists of indices.
constexpr std::uint32_t kNoIndex = 0xffffffffu;

struct Material {
  std::string name;
  /// Scene-linear diffuse albedo (MTL Kd), multiplied with the texture.
  Vec3 color{0.7f, 0.7f, 0.7f};
  /// Reflectance at normal incidence, for metallic = 0; a metal reflects `color` instead.
  Vec3 specular{0.04f, 0.04f, 0.04f};
  float roughness = 0.5f;  ///< 0 mirror .. 1 matte (from MTL Ns)
  float metallic = 0;      ///< 0 dielectric .. 1 metal
  float transmission = 0;  ///< fraction of the light that enters, as into glass
  float ior = 1.5f;        ///< refractive index of the interior, for transmission
  int texture = -1;        ///< index into Model::textures, -1 = none
};

/// Triangles over points that are welded by exact position, so that adjacency is known from
/// indices. Shading data is stored per corner (3 per triangle), because OBJ indexes normals and UVs
/// separately.
struct Model {
  std::string name;  ///< file stem, or the built-in shape's name
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;    ///< counter-clockwise from outside
  std::vector<Vec3> corner_normals;   ///< 3 * triangles.size(), unit; from the file, else computed
  std::vector<Vec2> corner_uvs;       ///< 3 * triangles.size(), or empty; v up as in OBJ
  std::vector<std::uint32_t> labels;  ///< one per triangle: index into label_names
  std::vector<std::string> label_names;           ///< OBJ groups/objects; at least one
  std::vector<std::uint32_t> triangle_materials;  ///< one per triangle: index into materials
  std::vector<Material> materials;  ///< one or more; none in an object made of moving balls
  std::vector<std::shared_ptr<const Texture>> textures;

  Box box() const { return bounding_box(points); }
  operator MeshView() const { return {points, triangles}; }
};

}  // namespace polymorph
