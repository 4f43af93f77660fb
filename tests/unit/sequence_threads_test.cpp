// What a sequence does on several threads, all of it, in a size that ends under the thread
// sanitizer: pixels, fields and boundaries, the handover, limbs. The tests of the same things in
// sequence_prepare_test.cpp and sequence_handover_test.cpp are larger and ask for more.
#include <gtest/gtest.h>

#include "base/file.h"
#include "base/parallel.h"
#include "film/render_sequence.h"
#include "image/image_io.h"
#include "inspect/analyze_sequence.h"
#include "mesh/mesh_check.h"
#include "scene/load_scene.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/prepare/prepare.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

class SmallSequence : public FolderTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(write_file(folder / "scene.json",
                           R"({"source": "sphere", "target": "torus", "frames": {"count": 8},
      "spheres": {"balls": 8}, "surface": {"resolution": 16},
      "image": {"width": 16, "height": 12, "samples": 1}})")
                    .ok());
  }
  void TearDown() override { set_thread_count(0); }
  Scene scene(const std::vector<Override>& overrides = {}) {
    const auto loaded = load_scene(folder / "scene.json", overrides);
    EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : loaded.error().message);
    return loaded.ok() ? coarse(*loaded) : Scene{};
  }
  /// Fits to few samples, as previews do, because these tests run under the thread sanitizer too.
  static Scene coarse(Scene scene) {
    for (ActorSettings& actor : scene.actors) {
      actor.source.spheres.coarse = actor.target.spheres.coarse = true;
      for (ObjectSettings& object : actor.intermediate) object.spheres.coarse = true;
    }
    return scene;
  }
};

TEST_F(SmallSequence, PixelsAreTheSameOnOneThreadAndOnFour) {
  const auto digest = [&](int threads, const char* name) {
    set_thread_count(threads);
    SequenceSettings s;
    s.frames = {2, 5};
    s.exr = *parse_pattern((folder / name / "f.##.exr").string());
    s.device = "cpu";
    const auto report = render_sequence(scene(), s, nullptr);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return report.ok() ? report->frames.at(0).digest + report->frames.at(1).digest : "";
  };
  const std::string one = digest(1, "one");
  EXPECT_EQ(one.size(), 64u);
  EXPECT_EQ(one, digest(4, "four"));
}

TEST_F(SmallSequence, EveryFieldAndBoundaryGivesClosedSurfaces) {
  const auto engine = make_cpu_engine();
  for (const char* kind : {"gaussian", "wyvill", "inverse_square"})
    for (const char* boundary : {"project", "blend", "crossfade"}) {
      const auto prepared =
          prepare_scene(scene({{"field.kind", fmt::format("\"{}\"", kind)},
                               {"boundary.method", fmt::format("\"{}\"", boundary)}}),
                        *engine, {shared_cache()});
      ASSERT_TRUE(prepared.ok()) << prepared.error().message;
      for (const int frame : {2, 5}) {
        const auto geometry = geometry_at(*prepared, *engine, frame);
        ASSERT_TRUE(geometry.ok()) << geometry.error().message;
        const Mesh& surface = geometry->actors[0].surface;
        EXPECT_TRUE(surface.triangles.empty() || check_mesh(surface).is_closed())
            << kind << ' ' << boundary << ' ' << frame;
      }
      const auto between = geometry_at(*prepared, *engine, 4);
      ASSERT_TRUE(between.ok()) << between.error().message;
      EXPECT_FALSE(between->actors[0].surface.triangles.empty());
    }
}

TEST_F(SmallSequence, TheHandoverIsAsSmallAsItsBallsAllow) {
  const auto engine = make_cpu_engine();
  const auto prepared = prepare_scene(scene(), *engine, {shared_cache()});
  ASSERT_TRUE(prepared.ok()) << prepared.error().message;
  const auto morphs = analyze_scene(*prepared, *engine, 3, [](int, int) { return true; });
  ASSERT_TRUE(morphs.ok()) << morphs.error().message;
  EXPECT_LE(*morphs->front().find("handover")->value, 0.01);
  EXPECT_EQ(*morphs->front().find("bad_surfaces")->value, 0);
}

TEST_F(SmallSequence, LimbsBecomeLimbs) {
  const std::vector<Override> small{{"spheres.balls", "24"}, {"surface.resolution", "24"}};
  const auto limbs = load_scene(source_dir() / "scenes/effects/limbs.json", small);
  ASSERT_TRUE(limbs.ok()) << limbs.error().message;
  const auto engine = make_cpu_engine();
  const auto prepared = prepare_scene(coarse(*limbs), *engine, {shared_cache()});
  ASSERT_TRUE(prepared.ok()) << prepared.error().message;
  const auto morphs = analyze_scene(*prepared, *engine, 3, [](int, int) { return true; });
  ASSERT_TRUE(morphs.ok()) << morphs.error().message;
  EXPECT_GE(*morphs->front().find("attributes")->value, 0.8);
}

}  // namespace
}  // namespace polymorph
