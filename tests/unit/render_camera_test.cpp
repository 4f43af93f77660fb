#include <cmath>

#include "testing/render.h"

namespace polymorph {
namespace {

struct Extent {
  float left = 1, right = -1, bottom = 1, top = -1;  // in half pictures, -1 .. 1
};

Extent project(const Camera& camera, const Box& box, float aspect) {
  Extent extent;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = Vec3{i & 1 ? box.high.x : box.low.x, i & 2 ? box.high.y : box.low.y,
                        i & 4 ? box.high.z : box.low.z} -
                   camera.position;
    const float depth = dot(p, camera.forward);
    EXPECT_GT(depth, 0.0f);
    const float x = dot(p, camera.right) / (depth * camera.tan_half_fov_y * aspect);
    const float y = dot(p, camera.up) / (depth * camera.tan_half_fov_y);
    extent.left = std::min(extent.left, x);
    extent.right = std::max(extent.right, x);
    extent.bottom = std::min(extent.bottom, y);
    extent.top = std::max(extent.top, y);
  }
  return extent;
}

void expect_orthonormal(const Camera& camera) {
  EXPECT_NEAR(length(camera.right), 1, 1e-5f);
  EXPECT_NEAR(length(camera.up), 1, 1e-5f);
  EXPECT_NEAR(length(camera.forward), 1, 1e-5f);
  EXPECT_NEAR(dot(camera.right, camera.up), 0, 1e-5f);
  EXPECT_NEAR(dot(camera.right, camera.forward), 0, 1e-5f);
  EXPECT_NEAR(dot(cross(camera.right, camera.up), camera.forward), -1, 1e-5f);
}

TEST(Camera, FramesABoxWithItsMarginAndNoCloser) {
  const Box boxes[] = {
      {{-1, 0, -1}, {1, 2, 1}}, {{-4, 0, -1}, {3, 1, 1}}, {{10, 5, 0}, {11, 25, 1}}};
  for (const Box& box : boxes)
    for (float azimuth : {-130.0f, 0.0f, 28.0f, 90.0f})
      for (float elevation : {-20.0f, 16.0f, 70.0f, 90.0f}) {
        CameraSettings settings;
        settings.azimuth = azimuth;
        settings.elevation = elevation;
        settings.margin = 0.1f;
        const Camera camera = make_camera(settings, box, 640, 480);
        expect_orthonormal(camera);
        const Extent e = project(camera, box, 640.0f / 480.0f);
        const float largest = 1 - 2 * settings.margin;
        EXPECT_LE(std::max(e.right, -e.left), largest + 1e-3f);
        EXPECT_LE(std::max(e.top, -e.bottom), largest + 1e-3f);
        // Centred both ways, and touching the margin in at least one.
        EXPECT_NEAR(e.left, -e.right, 2e-3f);
        EXPECT_NEAR(e.bottom, -e.top, 2e-3f);
        EXPECT_NEAR(std::max(e.right, e.top), largest, 2e-3f);
      }
}

TEST(Camera, AzimuthZeroLooksFromPlusZAndNinetyFromPlusX) {
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  CameraSettings settings;
  settings.elevation = 0;
  settings.azimuth = 0;
  EXPECT_NEAR(make_camera(settings, box, 100, 100).forward.z, -1, 1e-5f);
  settings.azimuth = 90;
  EXPECT_NEAR(make_camera(settings, box, 100, 100).forward.x, -1, 1e-5f);
  settings.elevation = 30;
  EXPECT_GT(make_camera(settings, box, 100, 100).position.y, 0);
}

TEST(Camera, TakesAGivenPositionAsItIs) {
  CameraSettings settings;
  settings.position = Vec3{3, 4, 5};
  settings.target = Vec3{3, 4, -5};
  settings.fov = 90;
  const Camera camera = make_camera(settings, {{-1, -1, -1}, {1, 1, 1}}, 100, 50);
  EXPECT_EQ(camera.position, (Vec3{3, 4, 5}));
  EXPECT_NEAR(camera.forward.z, -1, 1e-6f);
  EXPECT_NEAR(camera.up.y, 1, 1e-6f);
  EXPECT_NEAR(camera.tan_half_fov_y, 1, 1e-6f);
}

TEST(Camera, KeepsAGivenTargetInTheMiddle) {
  const Box box{{-1, 0, -1}, {1, 2, 1}};
  CameraSettings settings;
  settings.target = Vec3{0.5f, 0.2f, 0};
  const Camera camera = make_camera(settings, box, 640, 480);
  const Vec3 to_target = normalized(*settings.target - camera.position);
  EXPECT_NEAR(dot(to_target, camera.forward), 1, 1e-5f);
  const Extent e = project(camera, box, 640.0f / 480.0f);
  const float largest = 1 - 2 * settings.margin;
  EXPECT_NEAR(std::max({e.right, -e.left, e.top, -e.bottom}), largest, 2e-3f);
}

TEST(Camera, EmptyAndFlatBoxesStillGiveAUsableCamera) {
  for (const Box& box : {Box{}, Box{{2, 2, 2}, {2, 2, 2}}}) {
    const Camera camera = make_camera({}, box, 640, 480);
    expect_orthonormal(camera);
    EXPECT_TRUE(std::isfinite(camera.position.x + camera.position.y + camera.position.z));
  }
}

}  // namespace
}  // namespace polymorph
