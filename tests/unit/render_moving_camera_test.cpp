// Cameras that move: framing, motion vectors, motion blur.
#include <algorithm>

#include "testing/render.h"

namespace polymorph {
namespace {

using namespace testing;

const std::vector<Vec3> kPoints{{-1, 0, -0.5f}, {1, 0, -0.5f}, {1, 2, 0.5f}, {-1, 2, 0.5f}};

CameraSettings turned(float azimuth) {
  CameraSettings settings;
  settings.azimuth = azimuth;
  return settings;
}

/// How far out of the picture's middle the outermost point is, 1 at the border.
float reach(const Camera& camera, float aspect) {
  float largest = 0;
  for (const Vec3& point : kPoints) {
    const Vec3 p = point - camera.position;
    const float depth = dot(p, camera.forward) * camera.tan_half_fov_y;
    largest = std::max({largest, std::fabs(dot(p, camera.right)) / (depth * aspect),
                        std::fabs(dot(p, camera.up)) / depth});
  }
  return largest;
}

TEST(MovingCamera, OneDistanceKeepsTheMarginFromAllSides) {
  std::vector<CameraSettings> poses;
  for (int i = 0; i < 16; ++i) poses.push_back(turned(22.5f * static_cast<float>(i)));
  const Framing framing = make_framing(poses, kPoints, 640, 480);
  float largest = 0;
  for (const CameraSettings& pose : poses) {
    const Camera camera = make_camera(pose, framing);
    EXPECT_NEAR(length(camera.position - framing.anchor), framing.distance, 1e-4f);
    largest = std::max(largest, reach(camera, 640.0f / 480));
  }
  EXPECT_NEAR(largest, 1 - 2 * poses[0].margin, 2e-3f);
}

TEST(MovingCamera, ThatLooksOneWayIsFramedLikeOneThatStandsStill) {
  CameraSettings settings = turned(28), zoomed = settings;
  zoomed.fov = 15;
  const Camera still = make_camera(settings, kPoints, 640, 480);
  const Framing framing = make_framing(std::vector{settings, zoomed}, kPoints, 640, 480);
  const Camera moving = make_camera(settings, framing);
  EXPECT_NEAR(length(moving.position - still.position), 0, 1e-4f);
  // Zooming in does not move it.
  EXPECT_EQ(make_camera(zoomed, framing).position, moving.position);
}

TEST(MovingCamera, OrbitAndDollyGoAroundTheTarget) {
  CameraSettings settings;
  settings.position = Vec3{0, 1, 4};
  settings.target = Vec3{1, 1, 0};
  const Camera before = make_camera(settings, kPoints, 100, 100);
  settings.orbit = 90;
  settings.dolly = 0.5f;
  const Camera after = make_camera(settings, kPoints, 100, 100);
  // (-1, 0, 4) seen from the target turns to (4, 0, 1), and comes to its half.
  EXPECT_NEAR(length(after.position - Vec3{3, 1, 0.5f}), 0, 1e-5f);
  EXPECT_NEAR(dot(after.forward, normalized(*settings.target - after.position)), 1, 1e-6f);
  EXPECT_NEAR(before.focus, std::sqrt(17.0f), 1e-5f);
  EXPECT_NEAR(after.focus, 0.5f * std::sqrt(17.0f), 1e-5f) << "the focus stays on the target";
  CameraSettings framed = turned(10);
  framed.orbit = 30;
  const Camera one = make_camera(framed, kPoints, 100, 100),
               other = make_camera(turned(40), kPoints, 100, 100);
  EXPECT_NEAR(length(one.position - other.position), 0, 1e-4f);
}

/// A ball on a floor, from a camera that goes a little round it, nearer and up.
struct MovingStage : BallOnFloor {
  Camera next;
  MovingStage() {
    CameraSettings settings;
    settings.azimuth += 5;
    settings.elevation += 2;
    settings.dolly = 0.95f;
    next = make_camera(settings, scene.bounds, 64, 48);
    scene.camera_motion = CameraMotion{scene.camera, scene.camera, next};
  }
};

/// Where the camera shows a point, in pixels from the upper left corner.
Vec2 pixel_of(const Camera& camera, Vec3 point, int width, int height) {
  const Vec3 p = point - camera.position;
  const double scale = 0.5 * height / static_cast<double>(camera.tan_half_fov_y) /
                       static_cast<double>(dot(p, camera.forward));
  return {static_cast<float>(0.5 * width + scale * static_cast<double>(dot(p, camera.right))),
          static_cast<float>(0.5 * height - scale * static_cast<double>(dot(p, camera.up)))};
}

TEST(MovingCamera, MotionVectorsOfAStillSceneAreTheReprojection) {
  const MovingStage stage;
  RenderSettings settings = small_settings(1);
  settings.image.width = 64;
  settings.image.height = 48;
  settings.image.aovs = "P,motion,id";
  const Image image = render_or_fail(stage.scene, settings);
  const auto at = [&](int x, int y, const char* name) {
    return image.at(x, y, image.find_channel(name));
  };
  float longest = 0;
  int ball = 0, floor = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const float id = at(x, y, "id");
      const Vec2 motion{at(x, y, "motion.X"), at(x, y, "motion.Y")};
      if (id == 0) {
        EXPECT_EQ(motion, (Vec2{})) << "the studio's paper goes with the camera";
        continue;
      }
      (id == 1 ? floor : ball) += 1;
      const Vec2 then =
          pixel_of(stage.next, {at(x, y, "P.X"), at(x, y, "P.Y"), at(x, y, "P.Z")}, 64, 48);
      EXPECT_NEAR(motion.x, then.x - (static_cast<float>(x) + 0.5f), 2e-3f) << x << " " << y;
      EXPECT_NEAR(motion.y, then.y - (static_cast<float>(y) + 0.5f), 2e-3f) << x << " " << y;
      longest = std::max(longest, std::hypot(motion.x, motion.y));
    }
  EXPECT_GT(ball, 200);
  EXPECT_GT(floor, 200);
  EXPECT_GT(longest, 1.0f);
}

TEST(MovingCamera, MotionVectorsAddTheObjectsOwnWayAndThatOfTheSky) {
  MovingStage stage;
  const std::vector<Vec3> way(stage.ball.positions.size(), Vec3{0, 0.2f, 0});
  stage.scene.meshes[0].displacement = way;
  stage.scene.environment = constant_sky(1);
  stage.scene.ground.enabled = false;
  RenderSettings settings = small_settings(1);
  settings.image.aovs = "P,motion,id";
  const Image image = render_or_fail(stage.scene, settings);
  const auto at = [&](int x, int y, const char* name) {
    return image.at(x, y, image.find_channel(name));
  };
  int ball = 0, sky = 0;
  for (int y = 0; y < 36; ++y)
    for (int x = 0; x < 48; ++x) {
      const bool hit = at(x, y, "id") > 0;
      (hit ? ball : sky) += 1;
      // A point of the sky is very far away in the direction of its pixel.
      const Camera& c = stage.scene.camera;
      const float scale = 2 * c.tan_half_fov_y / 36;
      const Vec3 point =
          hit ? Vec3{at(x, y, "P.X"), at(x, y, "P.Y") + 0.2f, at(x, y, "P.Z")}
              : stage.next.position +
                    (c.forward + c.right * ((static_cast<float>(x) - 23.5f) * scale) +
                     c.up * ((17.5f - static_cast<float>(y)) * scale));
      const Vec2 then = pixel_of(stage.next, point, 48, 36);
      EXPECT_NEAR(at(x, y, "motion.X"), then.x - (static_cast<float>(x) + 0.5f), 2e-3f);
      EXPECT_NEAR(at(x, y, "motion.Y"), then.y - (static_cast<float>(y) + 0.5f), 2e-3f);
    }
  EXPECT_GT(ball, 100);
  EXPECT_GT(sky, 100);
}

TEST(MovingCamera, TheShutterSeesAllThatTheCameraSeesMeanwhile) {
  BallOnFloor stage;
  RenderScene& scene = stage.scene;
  CameraSettings from, to;  // a track to the right
  from.position = Vec3{-0.3f, 1, 4};
  to.position = Vec3{0.3f, 1, 4};
  from.target = Vec3{-0.3f, 0, 0};
  to.target = Vec3{0.3f, 0, 0};
  CameraMotion motion{
      make_camera(from, scene.bounds, 64, 48), make_camera(to, scene.bounds, 64, 48), {}};
  RenderSettings settings = small_settings(64);
  settings.image.aovs = "none";
  CameraSettings middle = from;
  middle.position->x = middle.target->x = 0;
  const std::optional<Camera> rig = make_camera(middle, scene.bounds, 64, 48);  // lights stand
  scene.rig = rig;
  // The mean of many pictures on the way.
  Image mean;
  constexpr int kSteps = 16;
  for (int i = 0; i < kSteps; ++i) {
    CameraSettings between = from;
    between.position->x = between.target->x =
        0.6f * ((static_cast<float>(i) + 0.5f) / kSteps - 0.5f);
    scene.camera = make_camera(between, scene.bounds, 64, 48);
    const Image one = render_or_fail(scene, settings);
    if (i == 0)
      mean = one;
    else
      for (std::size_t k = 0; k < mean.pixels.size(); ++k) mean.pixels[k] += one.pixels[k];
  }
  for (float& value : mean.pixels) value /= kSteps;
  scene.camera = *rig;
  const Image still = render_or_fail(scene, settings);
  scene.camera.shutter = 0.5f;
  scene.camera_motion = motion;
  settings.image.samples = 512;
  const Image blurred = render_or_fail(scene, settings);
  const auto distance = [&](const Image& image) {
    double sum = 0;
    for (std::size_t k = 0; k < mean.pixels.size(); ++k)
      sum += std::fabs(image.pixels[k] - mean.pixels[k]);
    return sum / static_cast<double>(mean.pixels.size());
  };
  EXPECT_LT(distance(blurred), 0.25 * distance(still));
}

TEST(MovingCamera, LightsStandWhereTheRigStands) {
  BallOnFloor stage;
  RenderScene& scene = stage.scene;
  const RenderSettings settings = small_settings(16);
  CameraSettings behind;
  behind.azimuth += 180;
  const Camera front = scene.camera, back = make_camera(behind, scene.bounds, 64, 48);
  const double lit = mean_green(render_or_fail(scene, settings));
  scene.camera = back;
  const double follows = mean_green(render_or_fail(scene, settings));
  scene.rig = front;
  const double stands = mean_green(render_or_fail(scene, settings));
  EXPECT_NEAR(follows, lit, 0.01 * lit) << "the ball looks the same from all sides";
  EXPECT_LT(stands, 0.97 * lit) << "its shaded side";
}

}  // namespace
}  // namespace polymorph
