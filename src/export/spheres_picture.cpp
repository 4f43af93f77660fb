#include "export/spheres_picture.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "base/exact_math.h"
#include "image/image_io.h"
#include "image/strip.h"
#include "render/render.h"

namespace polymorph {
namespace {

/// Makes a unit sphere: an icosahedron whose faces are cut into four, `cuts` times. Two cuts give
/// 320 triangles.
Mesh make_unit_sphere(int cuts = 2) {
  // The vertices of an icosahedron are the cyclic permutations of (0, +-1, +-g), where g is the
  // golden ratio.
  const float g = (1 + std::sqrt(5.0f)) / 2;
  Mesh mesh;
  for (const float a : {-1.0f, 1.0f})
    for (const float b : {-g, g})
      for (int axis = 0; axis < 3; ++axis)
        mesh.positions.push_back(axis == 0   ? Vec3{0, a, b}
                                 : axis == 1 ? Vec3{b, 0, a}
                                             : Vec3{a, b, 0});
  for (Vec3& p : mesh.positions) p = normalized(p);
  // The faces are the triples of mutual neighbours. An edge is 1.05 long.
  const auto are_neighbours = [&](std::uint32_t i, std::uint32_t j) {
    return length(mesh.positions[i] - mesh.positions[j]) < 1.1f;
  };
  for (std::uint32_t i = 0; i < 12; ++i)
    for (std::uint32_t j = i + 1; j < 12; ++j)
      for (std::uint32_t k = j + 1; k < 12; ++k) {
        if (!are_neighbours(i, j) || !are_neighbours(j, k) || !are_neighbours(i, k)) continue;
        const Vec3 a = mesh.positions[i], b = mesh.positions[j], c = mesh.positions[k];
        const bool outward = dot(cross(b - a, c - a), a) > 0;
        mesh.triangles.push_back(outward ? Triangle{{i, j, k}} : Triangle{{i, k, j}});
      }
  for (int cut = 0; cut < cuts; ++cut) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> midpoints;
    const auto find_midpoint = [&](std::uint32_t i, std::uint32_t j) {
      const auto [at, is_new] = midpoints.try_emplace(
          std::minmax(i, j), static_cast<std::uint32_t>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back(normalized(mesh.positions[i] + mesh.positions[j]));
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const Triangle& t : mesh.triangles) {
      const std::uint32_t a = t.v[0], b = t.v[1], c = t.v[2];
      const std::uint32_t ab = find_midpoint(a, b), bc = find_midpoint(b, c),
                          ca = find_midpoint(c, a);
      for (const Triangle& quarter : {Triangle{{a, ab, ca}}, Triangle{{ab, b, bc}},
                                      Triangle{{ca, bc, c}}, Triangle{{ab, bc, ca}}})
        finer.push_back(quarter);
    }
    mesh.triangles = std::move(finer);
  }
  mesh.normals = mesh.positions;
  return mesh;
}

/// Makes twelve pale colours of the colour wheel. Consecutive colours are 150 degrees apart.
std::vector<Material> make_color_wheel() {
  std::vector<Material> materials;
  for (int i = 0; i < 12; ++i) {
    // The hue is i * 150 degrees. Red, green and blue are cosines that are 120 degrees apart.
    const auto component = [&](int shift) {
      const double angle = (i * 5 + shift) % 12 / 12.0 * 2 * exact::kPi;
      return static_cast<float>(0.42 + 0.26 * exact::cos(angle));
    };
    Material material;
    material.color = {component(0), component(8), component(4)};
    material.roughness = 0.4f;
    materials.push_back(material);
  }
  return materials;
}

/// Makes one mesh of a copy of the unit sphere `unit` per sphere.
Mesh copy_to_spheres(const std::vector<Sphere>& spheres, const Mesh& unit) {
  Mesh mesh;
  for (const Sphere& sphere : spheres) {
    const auto first_vertex = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec3 p : unit.positions) {
      mesh.positions.push_back(sphere.center + p * sphere.radius);
      mesh.normals.push_back(p);
    }
    for (const Triangle& t : unit.triangles)
      mesh.triangles.push_back(
          {{first_vertex + t.v[0], first_vertex + t.v[1], first_vertex + t.v[2]}});
  }
  return mesh;
}

}  // namespace

Mesh make_sphere_mesh(const std::vector<Sphere>& spheres) {
  return copy_to_spheres(spheres, make_unit_sphere());
}

Status write_spheres_picture(const std::filesystem::path& path, const Model& model,
                             const std::vector<Sphere>& spheres, const Mesh& surface, int width) {
  RenderSettings settings;
  settings.image.width = width;
  settings.image.height = width;
  settings.image.aovs = "none";
  RenderScene scene;
  scene.bounds = model.box();
  scene.camera = make_camera(CameraSettings{}, model.points, width, width);
  scene.ground.height = scene.bounds.low.y - 0.02f * scene.bounds.diagonal();

  // Make the spheres. If there are more than kManySpheres, each is only a few pixels large, and its
  // faces are not cut, which would take gigabytes.
  constexpr std::size_t kManySpheres = 65536;
  const Mesh balls =
      copy_to_spheres(spheres, make_unit_sphere(/*cuts=*/spheres.size() > kManySpheres ? 0 : 2));
  const std::vector<Material> colors = make_color_wheel();
  std::vector<std::uint32_t> ball_colors;
  const std::size_t triangles_per_sphere =
      spheres.empty() ? 1 : balls.triangles.size() / spheres.size();
  for (std::size_t t = 0; t < balls.triangles.size(); ++t)
    ball_colors.push_back(static_cast<std::uint32_t>(t / triangles_per_sphere % colors.size()));

  // Describe the three meshes.
  std::array<RenderMesh, 3> meshes;
  meshes[0].positions = model.points;
  meshes[0].triangles = model.triangles;
  meshes[0].corner_normals = model.corner_normals;
  meshes[0].corner_uvs = model.corner_uvs;
  meshes[0].triangle_materials = model.triangle_materials;
  meshes[0].materials = model.materials;
  meshes[0].textures = model.textures;
  meshes[1].positions = balls.positions;
  meshes[1].triangles = balls.triangles;
  meshes[1].vertex_normals = balls.normals;
  meshes[1].triangle_materials = ball_colors;
  meshes[1].materials = colors;
  const std::vector<Material> clay(1);
  meshes[2].positions = surface.positions;
  meshes[2].triangles = surface.triangles;
  meshes[2].vertex_normals = surface.normals;
  meshes[2].materials = clay;

  // Render each, and join the pictures.
  PM_TRY(Renderer renderer, Renderer::create());
  std::vector<Image> pictures;
  for (RenderMesh& mesh : meshes) {
    mesh.id = 2;  // the smallest id of a mesh (render/render.h)
    scene.meshes = {mesh};
    PM_TRY(Image picture, renderer.render(scene, settings));
    pictures.push_back(std::move(picture));
  }
  const std::array<std::string, 3> labels{"model", fmt::format("{} spheres", spheres.size()),
                                          "surface of the balls"};
  StripSettings strip;
  strip.columns = 3;
  PM_TRY(const Image sheet, make_strip(pictures, labels, strip));
  PngSettings png;
  png.effort = PngEffort::kSmall;
  return write_image(path, sheet, png);
}

}  // namespace polymorph
