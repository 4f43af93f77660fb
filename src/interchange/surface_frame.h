// Surface of an actor in one frame, with all attributes that are exported.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "image/texture.h"
#include "kernels/types.h"

namespace polymorph {

/// Material of some of a surface's triangles.
struct SurfaceMaterial {
  std::string name;
  Vec3 color{1, 1, 1};  ///< scene-linear base colour, multiplied with the texture
  std::shared_ptr<const Texture> texture;  ///< null = none
  float roughness = 0.5f;                  ///< 0 mirror .. 1 matte
  float metallic = 0;
  float transmission = 0;  ///< fraction of the light that enters, as into glass
  float ior = 1.5f;
};
/// Compares everything except the name.
bool same_material(const SurfaceMaterial& a, const SurfaceMaterial& b);

/// Surface of one actor in one frame. The triangles around a point share it.
struct SurfaceFrame {
  bool is_model = false;  ///< an object's own mesh, not an extracted surface
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  std::vector<Vec3> normals;  ///< one per position, unit length; empty: flat shading
  /// 3 per triangle, for a model with sharp edges; else empty.
  std::vector<Vec3> corner_normals;
  std::vector<Vec3> velocities;       ///< one per position, scene units per second; or empty
  std::vector<Vec3> colors;           ///< one per position, scene-linear; or empty
  std::vector<std::uint32_t> labels;  ///< one per position: index of its label's name; or empty
  std::vector<Vec2> corner_uvs;       ///< 3 per triangle, v up; or empty
  std::vector<std::uint32_t> triangle_materials;  ///< one per triangle: index into materials
  /// Between two objects, texture coordinates and materials are those of the object with the larger
  /// weight. Empty if no materials are known.
  std::vector<SurfaceMaterial> materials;
  /// True if several objects' materials, or an object's and the scene's common look, are mixed.
  /// `colors` and `mixture` then give the appearance instead of `materials`.
  bool is_mixed = false;
  /// Material of a mixed surface: white, with the means of all other properties over the surface.
  SurfaceMaterial mixture;
};

/// A perspective camera in the form that other programs use.
struct FrameCamera {
  Vec3 position, right, up, forward;  ///< position in the scene, and orthonormal axes
  float tan_half_fov_y = 0.27f;
  float aspect = 4.0f / 3;  ///< width / height
  float focus = 1;          ///< focus distance, scene units
};

/// Properties of the whole sequence, known before the first frame.
struct SurfaceSequence {
  std::vector<std::string> actors;                    ///< names of the actors
  std::vector<std::vector<std::string>> label_names;  ///< names of each actor's labels
  float fps = 24;
  int first_frame = 1, last_frame = 1;
  std::vector<FrameCamera> cameras{1};  ///< one per frame, or one for all
  bool has_corner_normals = false;      ///< whether any frame has them
  /// All frames of an actor have the same triangles and texture coordinates.
  bool constant_topology = false;
};

}  // namespace polymorph
