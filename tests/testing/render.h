// Small meshes and scenes for the tests of the renderer.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "render/math/vector_math.h"
#include "render/render.h"
#include "testing/texture.h"

namespace polymorph::testing {

struct TestMesh {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  std::vector<Vec3> normals;  // one per position
  std::vector<Vec2> uvs;      // three per triangle
  std::vector<Material> materials{Material{}};
  std::vector<std::shared_ptr<const Texture>> textures;
};

/// Returns a sphere around the origin, with the same bits on every processor.
inline TestMesh make_ball(int columns, int rows, float radius = 1) {
  TestMesh mesh;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const float t = std::numbers::pi_v<float> * static_cast<float>(j) / static_cast<float>(rows);
      const float p =
          2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(columns);
      mesh.normals.push_back({sine(t) * sine(p), cosine(t), sine(t) * cosine(p)});
      mesh.positions.push_back(mesh.normals.back() * radius);
    }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const auto at = [&](int row, int column) {
        return static_cast<std::uint32_t>(row * columns + column % columns);
      };
      if (j > 0) mesh.triangles.push_back({{at(j, i), at(j + 1, i), at(j, i + 1)}});
      if (j < rows - 1) mesh.triangles.push_back({{at(j, i + 1), at(j + 1, i), at(j + 1, i + 1)}});
    }
  return mesh;
}

/// Returns a square with edges of 2 `half` along the unit vectors `right` and `up`; uv (0, 0) is at
/// the lower left.
inline TestMesh make_square(Vec3 center, Vec3 right, Vec3 up, float half) {
  TestMesh mesh;
  const Vec3 r = right * half, u = up * half;
  mesh.positions = {center - r - u, center + r - u, center + r + u, center - r + u};
  mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  mesh.normals.assign(4, cross(right, up));
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
  return mesh;
}

/// Returns a square in front of the ball of BallOnFloor, with a checkerboard as its texture.
inline TestMesh make_checkered_square() {
  Image checks = make_image(8, 8, {"R", "G", "B"});
  for (std::size_t i = 0; i < checks.pixels.size(); ++i)  // 3 values per pixel, 24 per row
    checks.pixels[i] = (i / 3 + i / 24) % 2 == 0 ? 0.9f : 0.1f;
  TestMesh square = make_square({0.3f, 0.2f, 0.9f}, {1, 0, 0}, {0, 1, 0}, 0.5f);
  square.textures = {float_texture(std::move(checks))};
  square.materials[0].texture = 0;
  return square;
}

inline Material matte(Vec3 color) {
  Material material;
  material.color = color;
  material.specular = {};
  material.roughness = 1;
  return material;
}

inline RenderMesh view_of(const TestMesh& mesh, float id = 2) {
  RenderMesh view;
  view.positions = mesh.positions;
  view.triangles = mesh.triangles;
  view.vertex_normals = mesh.normals;
  view.corner_uvs = mesh.uvs;
  view.materials = mesh.materials;
  view.textures = mesh.textures;
  view.id = id;
  return view;
}

inline std::shared_ptr<const Image> constant_sky(float radiance) {
  Image sky = make_image(8, 4, {"R", "G", "B"});
  for (float& value : sky.pixels) value = radiance;
  return std::make_shared<const Image>(std::move(sky));
}

/// Returns an empty scene under a sky of constant radiance, without floor and key light. The camera
/// is at (0, 0, 5) and looks along -z.
inline RenderScene furnace(float sky = 1) {
  RenderScene scene;
  scene.bounds = {{-1, -1, -1}, {1, 1, 1}};
  scene.environment = constant_sky(sky);
  scene.ground.enabled = false;
  scene.lights.key_intensity = 0;
  return scene;
}

inline LampSettings make_lamp(LampKind kind, Vec3 position) {
  LampSettings lamp;
  lamp.kind = kind;
  lamp.position = position;
  lamp.radius = 0.2f;
  lamp.intensity = 2;
  return lamp;
}

/// Moves the camera to this height on the y axis, looking straight down, with -z up in the picture.
inline void look_down(Camera& camera, float height) {
  camera.position = {0, height, 0};
  camera.forward = {0, -1, 0};
  camera.up = {0, 0, -1};
}

/// A ball of radius 0.7 on a floor, under the default lights.
struct BallOnFloor {
  TestMesh ball = make_ball(96, 48, 0.7f);
  RenderScene scene;
  BallOnFloor() {
    scene.meshes = {view_of(ball)};
    scene.bounds = {{-1, -0.7f, -1}, {1, 1, 1}};
    scene.ground.height = -0.7f;
    scene.camera = make_camera({}, scene.bounds, 64, 48);
  }
};

inline RenderSettings small_settings(int samples = 16) {
  RenderSettings settings;
  settings.image.width = 48;
  settings.image.height = 36;
  settings.image.samples = samples;
  return settings;
}

inline Image render_or_fail(const RenderScene& scene, const RenderSettings& settings) {
  Result<Renderer> renderer = Renderer::create();
  EXPECT_TRUE(renderer) << renderer.error().message;
  Result<Image> image = renderer->render(scene, settings);
  EXPECT_TRUE(image) << image.error().message;
  return *std::move(image);
}

inline Vec3 color_at(const Image& image, int x, int y) {
  return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
}

inline double mean_green(const Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) sum += image.at(x, y, 1);
  return sum / image.width / image.height;
}

}  // namespace polymorph::testing
