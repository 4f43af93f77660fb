// What goes to other programs: where points move, and what colours they have.
#include <gtest/gtest.h>

#include <algorithm>

#include "export/surface_frames.h"
#include "mesh/closest.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

class SurfaceFramesTest : public SceneTest {
 protected:
  SurfaceFramesTest()
      : SceneTest(R"("spheres": {"balls": 24}, "surface": {"resolution": 40},
                     "frames": {"count": 12, "fps": 10})") {}
  PreparedScene asking(const std::string& chain) {
    PreparedScene prepared = prepared_of(chain);
    request_attributes(prepared.scene, true, true);
    return prepared;
  }
  FrameGeometry at(const PreparedScene& prepared, int frame) {
    auto geometry = geometry_at(prepared, *engine, frame);
    EXPECT_TRUE(geometry.ok());
    return std::move(*geometry);
  }
};

TEST_F(SurfaceFramesTest, VelocitiesEndOnTheNextSurface) {
  for (const char* chain : {R"("source": "torus", "target": {"shape": "cube", "scale": 1.3})",
                            R"("source": "torus", "target": "cube",
                               "motion": {"interpolate": "balls"}, "boundary": {"method": "cut"})"}) {
    const PreparedScene prepared = asking(chain);
    int checked = 0;
    for (int frame = 2; frame < 11; ++frame) {
      const FrameGeometry now = at(prepared, frame), next = at(prepared, frame + 1);
      if (now.actors[0].moment.object >= 0) continue;
      const std::vector<SurfaceFrame> frames = surface_frames(prepared, now, &next);
      const SurfaceFrame& surface = frames.front();
      ASSERT_EQ(surface.velocities.size(), surface.positions.size());
      const Mesh goal = shown_mesh(prepared.actors[0], next.actors[0]);
      const ClosestPointQuery query(goal.positions, goal.triangles);
      double sum = 0;
      for (std::size_t i = 0; i < surface.positions.size(); ++i) {
        const Vec3 end = surface.positions[i] + surface.velocities[i] / 10;
        const auto distance = static_cast<double>(query.closest(end).distance);
        sum += distance * distance;
      }
      const double rms = std::sqrt(sum / static_cast<double>(surface.positions.size()));
      EXPECT_LE(rms, 1e-3 * static_cast<double>(bounding_box(goal.positions).diagonal())) << frame;
      ++checked;
    }
    EXPECT_GE(checked, 6);
  }
}

TEST_F(SurfaceFramesTest, ColoursGoFromOneObjectToTheOther) {
  const PreparedScene prepared = asking(
      R"("source": {"shape": "cube", "color": [1, 0, 0]}, "target": {"shape": "sphere", "color": [0, 0, 1]})");
  for (const int frame : {1, 6, 12}) {
    const std::vector<SurfaceFrame> frames = surface_frames(prepared, at(prepared, frame), nullptr);
    const SurfaceFrame& surface = frames.front();
    const float u = at(prepared, frame).actors[0].moment.u;
    // Colours change between a fifth and four fifths of the way (docs/method.md, Colour).
    const float t = std::clamp((u - 0.2f) / 0.6f, 0.0f, 1.0f), share = t * t * (3 - 2 * t);
    ASSERT_EQ(surface.colors.size(), surface.positions.size());
    for (const Vec3 c : surface.colors) {
      EXPECT_NEAR(c.x, 1 - share, 1e-4f);
      EXPECT_NEAR(c.z, share, 1e-4f);
    }
    EXPECT_EQ(surface.is_mixed, frame == 6);
    EXPECT_EQ(surface.is_model, frame != 6);
    EXPECT_EQ(surface.corner_normals.empty(), frame != 1) << "a cube has sharp edges";
    ASSERT_EQ(surface.triangle_materials.size(), surface.triangles.size());
    for (const std::uint32_t m : surface.triangle_materials) ASSERT_LT(m, surface.materials.size());
  }
}

TEST_F(SurfaceFramesTest, TheCommonLookIsOneMaterial) {
  const PreparedScene prepared = asking(
      R"("source": "cube", "target": "sphere", "look": {"kind": "metal", "color": [0.5, 0.25, 1]})");
  const std::vector<SurfaceFrame> frames = surface_frames(prepared, at(prepared, 6), nullptr);
  const SurfaceFrame& surface = frames.front();
  EXPECT_FALSE(surface.is_mixed);
  ASSERT_EQ(surface.materials.size(), 1u);
  EXPECT_EQ(surface.materials[0].metallic, 1);
  EXPECT_EQ(surface.materials[0].color, (Vec3{0.5f, 0.25f, 1}));
}

}  // namespace
}  // namespace polymorph
