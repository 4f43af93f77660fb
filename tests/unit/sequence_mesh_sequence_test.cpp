#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "assets/mesh_sequence.h"
#include "film/render_sequence.h"
#include "film/status.h"
#include "image/image_io.h"
#include "morph/timeline.h"
#include "scene/mesh_numbers.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/prepare/film_settings.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// A double pyramid over `sides` points: `sides` + 2 points and 2 `sides` triangles, always 2 wide
/// and 2 high but for its lower tip.
std::string pyramid(int sides, float low = -1) {
  std::string text = fmt::format("o body\nv 0 1 0\nv 0 {} 0\n", low);
  for (int i = 0; i < sides; ++i) {
    const double angle = 6.283185307179586 * i / sides;
    text += fmt::format("v {:.6f} 0 {:.6f}\n", std::cos(angle), std::sin(angle));
  }
  for (int i = 0; i < sides; ++i) {
    const int a = 3 + i, b = 3 + (i + 1) % sides;
    text += fmt::format("f 1 {} {}\nf 2 {} {}\n", b, a, a, b);
  }
  return text;
}

class MeshesTest : public SceneTest {
 protected:
  MeshesTest() : SceneTest(kCommon) {}

  void write_mesh(int number, const std::string& text) {
    ASSERT_TRUE(write_file(folder / fmt::format("m.{:04}.obj", number), text).ok());
  }
  /// Meshes of 4, 8, 12, ... sides.
  void write_meshes(int first, int last, int step = 1) {
    for (int n = first; n <= last; n += step) write_mesh(n, pyramid(4 * (n - first + 1)));
  }
  SequenceSettings settings(int first, int last) {
    SequenceSettings s;
    for (int frame = first; frame <= last; ++frame) s.frames.push_back(frame);
    s.exr = *parse_pattern((folder / "f.####.exr").string());
    s.device = "cpu";
    return s;
  }
  RunReport rendered(const Scene& scene, const SequenceSettings& given) {
    const auto report = render_sequence(scene, given, {});
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return report.ok() ? *report : RunReport{};
  }
  Image frame(int number) {
    auto image = read_image(folder / fmt::format("f.{:04}.exr", number));
    EXPECT_TRUE(image.ok());
    return image.ok() ? std::move(*image) : Image{};
  }
  static std::vector<float> colors(const Image& image) {
    std::vector<float> values;
    for (const char* name : {"R", "G", "B", "A"}) {
      const int channel = image.find_channel(name);
      EXPECT_GE(channel, 0);
      for (std::size_t i = static_cast<std::size_t>(channel); i < image.pixels.size();
           i += image.channel_count())
        values.push_back(image.pixels[i]);
    }
    return values;
  }
  std::string findings_of(const std::string& chain) {
    EXPECT_TRUE(write_file(folder / "scene.json", "{" + chain + "}").ok());
    const auto scene = load_scene(folder / "scene.json");
    EXPECT_FALSE(scene.ok());
    return scene.ok() ? "" : scene.error().message;
  }

  static constexpr const char* kCommon =
      R"("image": {"width": 32, "height": 24, "samples": 2, "max_depth": 2})";
  static constexpr const char* kPlayed = R"("source": {"model": "m.####.obj")";
};

TEST_F(MeshesTest, NumbersComeFromTheFiles) {
  write_meshes(3, 6);
  EXPECT_EQ(scene_of(R"("source": "m.####.obj")").actors[0].source.range, (std::vector{3, 6}));
  const Scene scene = scene_of(kPlayed + std::string("}"));
  EXPECT_EQ(scene.actors[0].source.name, "m");
  EXPECT_EQ(frame_count(scene), 4);
  EXPECT_EQ(chain_objects(scene).size(), 1u);
  const Scene backwards = scene_of(kPlayed + std::string(R"(, "range": [6, 4]})"));
  EXPECT_EQ(mesh_numbers(backwards.actors[0].source), (std::vector{6, 5, 4}));
  for (const int number : {3, 4, 5, 6}) fs::remove(folder / fmt::format("m.{:04}.obj", number));
  write_meshes(0, 40, 20);  // as simulations write them
  EXPECT_EQ(mesh_numbers(scene_of(kPlayed + std::string("}")).actors[0].source),
            (std::vector{0, 20, 40}));
  // What `info --json` writes is the same scene.
  const std::string text = scene_to_json(scene_of(kPlayed + std::string("}")), folder);
  const auto again = load_scene_text(folder / "again.json", text);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(scene_to_json(*again, folder), text);
}

TEST_F(MeshesTest, TimeFollowsRatesLoopsAndHolds) {
  write_meshes(1, 4);
  const auto shown = [&](const std::string& keys, const std::string& more = "") {
    const Scene scene = scene_of(kPlayed + keys + "}" + more);
    const Timeline timeline = make_timeline(scene, scene.actors[0]);
    std::string meshes;
    for (int f = 1; f <= frame_count(scene); ++f)
      meshes += std::to_string(morph_state_at(timeline, f).mesh + 1);
    return meshes;
  };
  EXPECT_EQ(shown(""), "1234");
  EXPECT_EQ(shown(R"(, "fps": 12)"), "11223344");
  EXPECT_EQ(shown(R"(, "fps": 48)"), "13");
  EXPECT_EQ(shown(R"(, "fps": 16)"), "112334");
  EXPECT_EQ(shown(R"(, "hold": 2)"), "123444");
  EXPECT_EQ(shown("", R"(, "frames": {"count": 7})"), "1234444");
  EXPECT_EQ(shown(R"(, "loop": true)", R"(, "frames": {"count": 10})"), "1234123412");
  EXPECT_EQ(shown(R"(, "loop": true, "hold": 1)", R"(, "frames": {"count": 11})"), "12344123441");
  EXPECT_EQ(shown("", R"(, "frames": {"hold_start": 2, "hold_end": 1})"), "1112344");
}

TEST_F(MeshesTest, ItShowsOneMeshAfterTheOtherAndKeepsNone) {
  write_meshes(1, 3);
  const PreparedScene prepared = prepared_of(kPlayed + std::string("}"));
  ASSERT_EQ(prepared.actors.size(), 1u);
  EXPECT_TRUE(prepared.actors[0].legs.empty());
  EXPECT_TRUE(prepared.actors[0].objects[0]->model.triangles.empty());
  for (int f = 1; f <= 3; ++f) {
    const auto geometry = geometry_at(prepared, *engine, f);
    ASSERT_TRUE(geometry.ok()) << geometry.error().message;
    EXPECT_EQ(geometry->actors[0].sequence_model->triangles.size(), 8u * static_cast<unsigned>(f));
    EXPECT_EQ(geometry->actors[0].points.size(), 4u * static_cast<unsigned>(f) + 2);
    EXPECT_EQ(geometry->actors[0].sequence_model.use_count(), 1);
    EXPECT_EQ(geometry->stage, "play");
  }
}

TEST_F(MeshesTest, ItStandsOnTheGroundOnce) {
  write_mesh(1, pyramid(4));
  write_mesh(2, pyramid(6, -3));  // the lowest of all
  write_mesh(3, pyramid(5));
  const PreparedScene prepared = prepared_of(kPlayed + std::string("}"));
  EXPECT_EQ(prepared.box.low.y, 0);
  EXPECT_EQ(prepared.box.high.y, 4);
  const auto first = geometry_at(prepared, *engine, 1), second = geometry_at(prepared, *engine, 2);
  EXPECT_EQ(bounding_box(first->actors[0].points).low.y, 2);
  EXPECT_EQ(bounding_box(second->actors[0].points).low.y, 0);
}

TEST_F(MeshesTest, AFrameIsTheRenderOfItsMesh) {
  write_meshes(1, 3);
  const std::string place = R"(, "up": "z", "rotate": [10, 20, 30], "scale": 1.5)",
                    view = R"(, "arrange": "none", "camera": {"position": [3, 2, 5],
                        "target": [0, 0, 0]}, "ground": {"height": -2})";
  rendered(scene_of(kPlayed + place + R"(, "range": [1, 3, 2]})" + view), settings(1, 2));
  const Image first = frame(1), last = frame(2);
  for (const int number : {1, 2}) fs::remove(folder / fmt::format("f.{:04}.exr", number));
  // The first and the last frame of a morph show the models themselves.
  rendered(scene_of(R"("source": {"model": "m.0001.obj")" + place +
                    R"(}, "target": {"model": "m.0003.obj")" + place + "}" + view +
                    R"(, "frames": {"count": 2}, "surface": {"resolution": 16},
                        "spheres": {"balls": 6, "fit": "none"}, "motion": {"interpolate": "balls"},
                        "boundary": {"method": "cut"})"),
           settings(1, 2));
  EXPECT_TRUE(colors(first) == colors(frame(1)));
  EXPECT_TRUE(colors(last) == colors(frame(2)));
}

TEST_F(MeshesTest, OneMissingMeshAndABrokenOneAreNamedAndTheOthersRendered) {
  write_meshes(1, 5);
  fs::remove(folder / "m.0002.obj");
  write_mesh(4, "v 0 0 zero\n");
  const Scene scene = scene_of(kPlayed + std::string("}"));
  const auto refused = render_sequence(scene, settings(1, 5), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInput);
  for (const char* part : {"mesh 2: ", "m.0002.obj: no such file", "mesh 4: ", "m.0004.obj:1"})
    EXPECT_NE(refused.error().message.find(part), std::string::npos) << refused.error().message;
  EXPECT_FALSE(fs::exists(folder / "f.0001.exr")) << "it is said before any work";
  SequenceSettings on = settings(1, 5);
  on.keep_going = true;
  const RunReport report = rendered(scene, on);
  EXPECT_EQ(report.count(FrameRecord::State::kDone), 3u);
  EXPECT_EQ(report.count(FrameRecord::State::kFailed), 2u);
  EXPECT_NE(report.frames[1].error.find("mesh 2: "), std::string::npos);
  // Frames that show neither need neither.
  SequenceSettings some = settings(5, 5);
  some.existing = Existing::kOverwrite;
  EXPECT_EQ(rendered(scene, some).count(FrameRecord::State::kDone), 1u);
  for (const int number : {1, 3, 5}) fs::remove(folder / fmt::format("m.{:04}.obj", number));
  EXPECT_FALSE(render_sequence(scene, on, {}).ok()) << "no mesh at all";
}

TEST_F(MeshesTest, OnlyTheFrameOfAChangedMeshIsRenderedAgain) {
  // The first mesh holds all others, so these do not move the camera.
  for (const int n : {1, 2, 3, 4}) write_mesh(n, pyramid(n == 1 ? 16 : 8));
  const Scene scene = scene_of(kPlayed + std::string("}"));
  SequenceSettings resumed = settings(1, 4);
  resumed.existing = Existing::kSkip;
  EXPECT_EQ(rendered(scene, resumed).count(FrameRecord::State::kDone), 4u);
  EXPECT_EQ(rendered(scene, resumed).count(FrameRecord::State::kSkipped), 4u);
  write_mesh(3, pyramid(4, -0.5f));
  const std::vector<int> numbers{1, 2, 3, 4};
  const auto hashes = expected_hashes(scene, numbers);
  ASSERT_TRUE(hashes.ok());
  const FrameFiles files{resumed.exr, {}};
  EXPECT_EQ(frame_states(files, numbers, *hashes),
            (std::vector{FileState::kCurrent, FileState::kCurrent, FileState::kStale,
                         FileState::kCurrent}));
  const RunReport report = rendered(scene, resumed);
  EXPECT_EQ(report.count(FrameRecord::State::kDone), 1u);
  EXPECT_EQ(report.frames[2].state, FrameRecord::State::kDone);
  // What is larger than all others does.
  write_mesh(3, pyramid(4, -9));
  EXPECT_EQ(rendered(scene, resumed).count(FrameRecord::State::kDone), 4u);
}

TEST_F(MeshesTest, VerticesThatCorrespondMove) {
  write_mesh(1, pyramid(8));
  write_mesh(2, pyramid(8, -2));
  write_mesh(3, pyramid(4, -2));
  const PreparedScene prepared = prepared_of(
      kPlayed + std::string(R"(, "scale": 2}, "arrange": "none", "camera": {"shutter": 0.5})"));
  const auto motion = [&](int number) {
    const auto geometry = geometry_at(prepared, *engine, number);
    EXPECT_TRUE(geometry.ok());
    return geometry->actors[0].displacement;
  };
  const std::vector<Vec3> moved = motion(1);
  ASSERT_EQ(moved.size(), 10u);
  EXPECT_EQ(std::count(moved.begin(), moved.end(), (Vec3{0, -2, 0})), 1) << "the lower tip moves";
  EXPECT_EQ(std::count(moved.begin(), moved.end(), Vec3{}), 9) << "all others stand";
  EXPECT_TRUE(motion(2).empty()) << "other faces, and no velocities";
  EXPECT_TRUE(motion(3).empty()) << "the last";
  // What a frame shows then depends on the next mesh, too.
  const std::string first = frame_hash(prepared.scene, prepared.hashes, 1),
                    second = frame_hash(prepared.scene, prepared.hashes, 2);
  write_mesh(3, pyramid(4, -1.5f));
  const PreparedScene after = prepared_of(
      kPlayed + std::string(R"(, "scale": 2}, "arrange": "none", "camera": {"shutter": 0.5})"));
  EXPECT_EQ(frame_hash(after.scene, after.hashes, 1), first);
  EXPECT_NE(frame_hash(after.scene, after.hashes, 2), second);
}

TEST_F(MeshesTest, ActorsPlayBesideMorphs) {
  write_meshes(1, 2);
  const PreparedScene prepared = prepared_of(
      R"("actors": [{"source": {"model": "m.####.obj", "loop": true}},
         {"source": "cube", "target": "sphere", "translate": [4, 0, 0], "per_leg": [5]}],
         "spheres": {"balls": 6, "fit": "none"}, "surface": {"resolution": 16})");
  EXPECT_EQ(prepared.frame_count, 5);
  const auto geometry = geometry_at(prepared, *engine, 4);
  ASSERT_TRUE(geometry.ok());
  EXPECT_EQ(geometry->actors[0].moment.mesh, 1);
  EXPECT_FALSE(geometry->actors[1].surface.triangles.empty());
}

TEST_F(MeshesTest, MistakesAreSaid) {
  write_meshes(1, 2);
  const auto says = [&](const std::string& chain, const char* part) {
    const std::string message = findings_of(chain);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  says(R"("source": "none.####.obj")", "no such files");
  says(R"("source": "m.#.obj")", "a lone # is ambiguous");
  says(R"("source": "m.####.obj", "intermediate": ["cube"])", "/target: is missing");
  says(R"("source": {"shape": "cube", "fps": 12}, "target": "sphere")", "is for a mesh sequence");
  says(R"("source": {"model": "m.####.obj", "range": [1]})", "first and last number");
  says(R"("source": {"model": "m.####.obj", "range": [1, 2, 0]})", "first and last number");
  says(R"("source": {"model": "m.####.obj", "range": [1, 20], "fps": 0.001})",
       "must be 100000 at most");
  says(R"("source": "m.0001.obj")", "/target: is missing");
}

}  // namespace
}  // namespace polymorph
