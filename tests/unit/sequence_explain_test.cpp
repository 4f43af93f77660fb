// Twelve changes planted into one scene, each of which is named.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "compare/explain.h"
#include "device/device.h"
#include "film/render_sequence.h"
#include "image/image_io.h"
#include "image/srgb.h"
#include "mesh/mesh_check.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_frame.h"
#include "sequence/frame/render_scene.h"
#include "testing/scene.h"
#include "testing/texture.h"

namespace polymorph {
namespace {

constexpr const char* kSmallFrames =
    R"("surface": {"resolution": 24}, "frames": {"count": 9}, "motion": {"interpolate": "balls"},
       "image": {"width": 96, "height": 72, "samples": 8, "aovs": "Z,N,id,albedo"})";
constexpr const char* kCubeToSphere = R"("source": "cube", "target": "sphere")";
constexpr int kModel = 1, kMiddle = 5;  // frames: the cube as it is, the balls' surface

struct Shot {
  Image image;
  FrameGeometry geometry;
};

class ExplainTest : public SceneTest {
 protected:
  ExplainTest() : SceneTest(kSmallFrames) {
    Result<Renderer> made = Renderer::create();
    EXPECT_TRUE(made);
    renderer = std::make_unique<Renderer>(std::move(*made));
  }

  /// Changes the model of the cube.
  template <class F>
  static void change_model(PreparedScene& prepared, const F& change) {
    change_object(prepared.actors[0], 0, [&](PreparedObject& object) { change(object.model); });
  }
  /// The scene, with a checked texture on the cube.
  PreparedScene scene(int balls = 12, const std::string& plan = "index") {
    PreparedScene prepared =
        prepared_of(fmt::format(R"({}, "spheres": {{"balls": {}}}, "plan": {{"method": "{}"}})",
                                kCubeToSphere, balls, plan));
    Image checks = make_image(16, 16, {"R", "G", "B"});
    for (std::size_t i = 0; i < checks.pixels.size(); ++i)
      checks.pixels[i] = (i / 3 % 16 / 4 + i / 48 / 4) % 2 == 0 ? 0.7f : 0.3f;
    change_model(prepared, [&](Model& model) {
      model.textures = {float_texture(checks)};
      if (model.materials.empty()) model.materials.push_back({});
      for (Material& material : model.materials) material.texture = 0;
    });
    return prepared;
  }
  Shot shot(const PreparedScene& prepared, int frame) {
    auto geometry = geometry_at(prepared, *engine, frame);
    EXPECT_TRUE(geometry.ok()) << geometry.error().message;
    return {image_of(prepared, *geometry), std::move(*geometry)};
  }
  Image image_of(const PreparedScene& prepared, const FrameGeometry& geometry) {
    auto image = render_frame(prepared, geometry, *renderer, "cpu", "");
    EXPECT_TRUE(image.ok());
    // As goldens are: through a file.
    auto bytes = encode_exr(*image);
    EXPECT_TRUE(bytes.ok());
    auto decoded = decode_image(*bytes, "frame");
    EXPECT_TRUE(decoded.ok()) << decoded.error().message;
    return std::move(*decoded);
  }
  std::string why(const Shot& now, const Shot& before, const PreparedScene& prepared) {
    ChangeContext context;
    context.surfaces_known = true;
    context.surfaces_equal =
        mesh_digest(join_surfaces(now.geometry)) == mesh_digest(join_surfaces(before.geometry));
    context.cell = prepared.actors[0].settings.cell;
    for (const Ball& ball : now.geometry.actors[0].balls) context.balls.push_back(ball.center);
    return explain_change(now.image, before.image, context);
  }
  /// What is said when `change` is made to the scene.
  template <class F>
  std::string planted(int frame, const F& change) {
    const PreparedScene before = scene();
    PreparedScene now = before;
    change(now);
    return why(shot(now, frame), shot(before, frame), now);
  }
  void expect_said(const std::string& said, const std::vector<std::string>& parts) {
    for (const std::string& part : parts)
      EXPECT_NE(said.find(part), std::string::npos) << "'" << said << "' lacks '" << part << "'";
  }

  std::unique_ptr<Renderer> renderer;
};

TEST_F(ExplainTest, NothingChanged) {
  EXPECT_EQ(planted(kModel, [](PreparedScene&) {}), "");
  EXPECT_EQ(planted(kMiddle, [](PreparedScene&) {}), "");
}

TEST_F(ExplainTest, Light) {
  expect_said(planted(kModel, [](PreparedScene& p) { p.scene.lights.key_azimuth += 20; }),
              {"only light differs"});
}

TEST_F(ExplainTest, Colour) {
  expect_said(planted(kModel,
                      [](PreparedScene& p) {
                        change_model(p, [](Model& model) {
                          for (Material& m : model.materials) m.color = m.color * 0.8f;
                        });
                      }),
              {"geometry equal", "albedo differs on `cube`: colour"});
}

TEST_F(ExplainTest, Roughness) {
  expect_said(planted(kModel,
                      [](PreparedScene& p) {
                        change_model(p, [](Model& model) {
                          for (Material& m : model.materials)
                            m.roughness = m.roughness > 0.5f ? 0.15f : 0.9f;
                        });
                      }),
              {"geometry and albedo equal", "`cube` reflects light differently", "roughness"});
}

TEST_F(ExplainTest, Camera) {
  expect_said(planted(kModel,
                      [](PreparedScene& p) {
                        const float distance =
                            dot(p.box.center() - p.camera.position, p.camera.forward);
                        const float pixel = 2 * distance * p.camera.tan_half_fov_y / 72;
                        p.camera.position = p.camera.position + p.camera.right * (2 * pixel);
                      }),
              {"camera moved by 2", "px"});
}

TEST_F(ExplainTest, GeometryByATenthOfACell) {
  const PreparedScene prepared = scene();
  const Shot before = shot(prepared, kMiddle);
  Shot now = before;
  Mesh& surface = now.geometry.actors[0].surface;
  ASSERT_FALSE(surface.positions.empty());
  const float cell = prepared.actors[0].settings.cell;
  Vec3 top = surface.positions[0];  // the point nearest to the camera
  for (const Vec3& p : surface.positions)
    if (dot(p, prepared.camera.forward) < dot(top, prepared.camera.forward)) top = p;
  ASSERT_GT(cell, 0);
  int moved = 0;
  for (Vec3& p : surface.positions)
    if (length(p - top) < 6 * cell) {
      p = p + normalized(p - prepared.box.center()) * (0.1f * cell);
      ++moved;
    }
  ASSERT_GT(moved, 10);
  now.image = image_of(prepared, now.geometry);
  ASSERT_NE(now.image.pixels, before.image.pixels) << moved << " of " << surface.positions.size();
  const std::string said = why(now, before, prepared);
  expect_said(said, {"surface: 1 pixel in ", "moved, worst 0.", " cells", "near ball "});
  const std::size_t at = said.find("worst ");
  ASSERT_NE(at, std::string::npos);
  const double worst = std::stod(said.substr(at + 6));
  EXPECT_GT(worst, 0.07) << said;
  EXPECT_LT(worst, 0.2) << said;
}

TEST_F(ExplainTest, Plan) {
  const PreparedScene before = scene(), now = scene(12, "transport");
  expect_said(why(shot(now, kMiddle), shot(before, kMiddle), now),
              {"plan: other balls become other balls", "surface: "});
}

TEST_F(ExplainTest, OneTexel) {
  expect_said(planted(kModel,
                      [](PreparedScene& p) {
                        change_model(p, [](Model& model) {
                          Image image = model.textures[0]->image;
                          for (int c = 0; c < 3; ++c) image.at(7, 8, c) = 0.9f;
                          model.textures[0] = float_texture(image);
                        });
                      }),
              {"geometry equal", "albedo differs on `cube` at ", "texture"});
}

TEST_F(ExplainTest, Seed) {
  expect_said(planted(kModel, [](PreparedScene& p) { p.scene.image.seed = 7; }),
              {"only noise differs: seed 7 in place of 0"});
  // And without what the header says.
  const PreparedScene before = scene();
  PreparedScene now = before;
  now.scene.image.seed = 7;
  Shot a = shot(now, kModel), b = shot(before, kModel);
  a.image.attributes.clear();
  expect_said(why(a, b, now), {"only noise differs (seed or samples)"});
}

TEST_F(ExplainTest, Samples) {
  expect_said(planted(kModel, [](PreparedScene& p) { p.scene.image.samples = 4; }),
              {"only noise differs: 4 samples in place of 8"});
}

TEST_F(ExplainTest, Gamma) {
  const PreparedScene prepared = scene();
  const Shot before = shot(prepared, kModel);
  Shot now = before;
  for (std::size_t i = 0; i < now.image.pixels.size(); i += now.image.channel_count())
    for (std::size_t c = 0; c < 3; ++c)
      now.image.pixels[i + c] = std::pow(now.image.pixels[i + c], 1.1f);
  expect_said(why(now, before, prepared), {"gamma", "to the power 1.1"});
  now = before;
  for (std::size_t i = 0; i < now.image.pixels.size(); i += now.image.channel_count())
    for (std::size_t c = 0; c < 3; ++c) now.image.pixels[i + c] *= 1.25f;
  expect_said(why(now, before, prepared), {"1.25 times the old ones: brightness"});
}

TEST_F(ExplainTest, Dither) {
  const PreparedScene prepared = scene();
  const Shot before = shot(prepared, kModel);
  Shot now = before;
  for (std::size_t i = 0; i < now.image.pixels.size(); i += now.image.channel_count())
    for (std::size_t c = 0; c < 3; ++c) {
      float& v = now.image.pixels[i + c];
      if (v < 1) v = srgb_to_linear(linear_to_srgb(v) + (random_float(1, i, c) - 0.5f) / 255);
    }
  expect_said(why(now, before, prepared), {"only rounding differs", "dither"});
}

TEST_F(ExplainTest, AMissingBall) {
  const PreparedScene before = scene(), now = scene(11);
  const Shot a = shot(now, kMiddle), b = shot(before, kMiddle);
  expect_said(why(a, b, now), {"a ball is missing of `cube`, 11 in place of 12", "surface: "});
}

TEST(Explain, AViewIsItsText) {
  PinholeView view{{1, 2.5f, -3}, {0, 0, -1}, {0, 1, 0}, 0.3f}, back;
  ASSERT_TRUE(parse_view(pinhole_view_text(view), back));
  EXPECT_EQ(pinhole_view_text(back), pinhole_view_text(view));
  EXPECT_FALSE(parse_view("1 2 3", back));
}

TEST(Explain, PicturesOfOtherProgramsHaveOnlyColours) {
  Image before = make_image(64, 64, {"R", "G", "B"});
  for (std::size_t i = 0; i < before.pixels.size(); ++i)
    before.pixels[i] = 0.2f + 0.5f * random_float(2, i / 3 / 8, 0);
  Image now = before;
  EXPECT_EQ(explain_change(now, before), "");
  for (std::size_t i = 0; i < now.pixels.size(); ++i)
    now.pixels[i] += 0.1f * (random_float(3, i, 0) - 0.5f);
  EXPECT_EQ(explain_change(now, before), "only noise differs (seed or samples)");
  now = before;
  for (std::size_t i = 0; i < now.pixels.size() / 2; ++i) now.pixels[i] *= 0.5f;
  EXPECT_EQ(explain_change(now, before), "the edges stay: light or colours differ");
  now = before;
  for (int y = 20; y < 24; ++y)
    for (int x = 30; x < 35; ++x) now.at(x, y, 0) += 0.3f;
  EXPECT_EQ(explain_change(now, before), "only 5 x 4 pixels from (30, 20) on differ");
}

TEST(Explain, ASilhouetteThatMovedIsNotCalledLight) {
  const auto disk = [](float center, float light) {
    Image image = make_image(64, 64, {"R", "G", "B"});
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x)
        for (int c = 0; c < 3; ++c) {
          const float dx = static_cast<float>(x) - center, dy = static_cast<float>(y) - 32;
          image.at(x, y, c) = dx * dx + dy * dy < 400 ? light - 0.005f * dx : 0.1f;
        }
    return image;
  };
  for (const float shift : {1.0f, 2.0f, 8.0f})
    EXPECT_EQ(explain_change(disk(30 + shift, 0.6f), disk(30, 0.6f)),
              "the edges moved: shapes, shadows or textures differ")
        << shift;
  EXPECT_EQ(explain_change(disk(30, 0.4f), disk(30, 0.6f)),
            "the edges stay: light or colours differ");
}

}  // namespace
}  // namespace polymorph
