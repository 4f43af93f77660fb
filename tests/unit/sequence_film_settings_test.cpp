#include "sequence/prepare/film_settings.h"

#include "base/parallel.h"
#include "film/render_sequence.h"
#include "film/status.h"
#include "image/image_io.h"
#include "morph/timeline.h"
#include "sequence/prepare/prepare.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Small and quick: what is seen does not matter.
class FilmTest : public SceneTest {
 protected:
  FilmTest()
      : SceneTest(R"("spheres": {"balls": 12, "fit": "none"}, "surface": {"resolution": 16},
          "motion": {"interpolate": "balls"}, "image": {"width": 48, "height": 36, "samples": 2})") {
  }
  ~FilmTest() override { set_thread_count(0); }

  SequenceSettings settings(int first, int last) {
    SequenceSettings s;
    for (int frame = first; frame <= last; ++frame) s.frames.push_back(frame);
    s.exr = *parse_pattern((folder / "f.####.exr").string());
    s.device = "cpu";
    s.cache_folder = shared_cache();
    return s;
  }
  Image frame(int number) {
    auto image = read_image(folder / fmt::format("f.{:04}.exr", number));
    EXPECT_TRUE(image.ok());
    return image.ok() ? std::move(*image) : Image{};
  }
  static std::string header(const Image& image, const char* name) {
    for (const Attribute& attribute : image.attributes)
      if (attribute.name == name)
        return std::visit([](const auto& v) { return fmt::format("{}", v); }, attribute.value);
    return "";
  }
};

std::string hash_of(const PreparedScene& prepared, int frame) {
  return frame_hash(prepared.scene, prepared.hashes, frame);
}

constexpr const char* kMorph = R"("source": "cube", "target": "torus")";

TEST_F(FilmTest, TimeIsCountedInSharesFramesAndLegs) {
  const Scene scene = scene_of(
      R"("source": "cube", "intermediate": [{"shape": "sphere", "hold": 2}], "target": "torus",
         "frames": {"per_leg": [4, 5], "hold_start": 3})");
  // Frames 1-3 stand; leg 1 moves from 4 to 8; 8, 9 and 10 show the sphere; leg 2 ends at 14.
  ASSERT_EQ(frame_count(scene), 14);
  EXPECT_DOUBLE_EQ(film_time(scene, 1).share, 0);
  EXPECT_DOUBLE_EQ(film_time(scene, 14).share, 1);
  EXPECT_DOUBLE_EQ(film_time(scene, 7.5).share, 0.5);
  EXPECT_DOUBLE_EQ(film_time(scene, 3).leg, 1);
  EXPECT_DOUBLE_EQ(film_time(scene, 4).leg, 1);
  EXPECT_DOUBLE_EQ(film_time(scene, 6).leg, 1.5);
  EXPECT_DOUBLE_EQ(film_time(scene, 8).leg, 2);
  EXPECT_DOUBLE_EQ(film_time(scene, 9.5).leg, 2);
  EXPECT_DOUBLE_EQ(film_time(scene, 12).leg, 2.5);
  EXPECT_DOUBLE_EQ(film_time(scene, 14).leg, 3);
}

TEST_F(FilmTest, AFramesHashIsOfItsOwnSettings) {
  const std::string keys = R"("frames": {"count": 8}, "look": {"kind": "matte", "color": {"keys":
      [{"frame": 4, "value": [1, 0, 0]}, {"frame": 6, "value": [0, )";
  const PreparedScene one = prepared_of(kMorph + (", " + keys) + "0, 1]}]}}"),
                      other = prepared_of(kMorph + (", " + keys) + "1, 0]}]}}");
  for (int f = 1; f <= 8; ++f) EXPECT_EQ(hash_of(one, f) == hash_of(other, f), f <= 4) << f;
  EXPECT_EQ(hash_of(one, 1), hash_of(one, 4)) << "nothing of the settings has changed yet";
  EXPECT_NE(hash_of(one, 4), hash_of(one, 5));
  EXPECT_EQ(hash_of(one, 6), hash_of(one, 8));
  const PreparedScene still = prepared_of(kMorph);
  EXPECT_EQ(hash_of(still, 3), still.hashes.scene);
}

TEST_F(FilmTest, AFramesHashKnowsWhereTheCameraGoes) {
  const auto keys = [](const char* last) {
    return std::string(kMorph) +
           R"(, "frames": {"count": 6}, "camera": {"position": {"easing": "linear", "keys":
             [{"frame": 1, "value": [0, 1, 5]}, {"frame": 3, "value": [0, 1, 5]},
              {"frame": 4, "value": [0, 1, )" +
           last + "]}]}}";
  };
  const PreparedScene one = prepared_of(keys("4")), other = prepared_of(keys("3"));
  // In frame 3 the camera itself is the same, but not where points are on the film in frame 4.
  for (int f = 1; f <= 6; ++f) EXPECT_EQ(hash_of(one, f) == hash_of(other, f), f <= 2) << f;
  EXPECT_FALSE(make_frame_view(one, 2).camera_motion);
  EXPECT_TRUE(make_frame_view(one, 3).camera_motion);
  EXPECT_FALSE(make_frame_view(one, 6).camera_motion);
  EXPECT_EQ(make_frame_view(one, 3).camera.position, (Vec3{0, 1, 5}));
  EXPECT_EQ(make_frame_view(one, 3).camera_motion->next.position, (Vec3{0, 1, 4}));
  EXPECT_EQ(make_frame_view(one, 5).rig->position, (Vec3{0, 1, 5})) << "lights stand";
}

TEST_F(FilmTest, OnlyFramesWhoseSettingsChangedAreRenderedAgain) {
  Scene first =
      scene_of(kMorph + std::string(R"(, "frames": {"count": 6}, "lights": {"key_intensity":
      {"keys": [{"frame": 3, "value": 1}, {"frame": 5, "value": 2}]}})"));
  SequenceSettings s = settings(1, 6);
  ASSERT_TRUE(render_sequence(first, s, nullptr).ok());
  Scene second = first;
  second.tracks.front().keys.back().value.x = 3;
  s.existing = Existing::kSkip;
  const auto report = render_sequence(second, s, nullptr);
  ASSERT_TRUE(report.ok());
  for (const FrameRecord& record : report->frames)
    EXPECT_EQ(record.state == FrameRecord::State::kSkipped, record.frame <= 3) << record.frame;
}

TEST_F(FilmTest, FramesAreKnownWithoutPreparingThem) {
  const std::string key = R"({"keys": [{"frame": 2, "value": )";
  const std::string moving = R"("camera": {"fov": )" + key + R"(30}, {"frame": 4, "value": )";
  const std::string retarget =
      R"("source": "cube", "intermediate": [{"shape": "sphere", "retarget": 0.5}],
         "target": "torus", "frames": {"count": 4}, )";
  const std::string plain = kMorph + std::string(R"(, "frames": {"count": 4}, )");
  // A key's value that is changed, and the first frame that it changes.
  struct Case {
    std::string before, after;
    int first;
  };
  const Case cases[]{
      {plain + R"("lights": {"key_intensity": )" + key + "0.5}, {\"frame\": 4, \"value\": ", "}]}}",
       3},
      {plain + moving, "}]}}", 2},  // its points' way to the next frame
      // The directions of all poses decide how far away a camera is that places itself.
      {plain + R"("camera": {"azimuth": )" + key + "30}, {\"frame\": 4, \"value\": ", "}]}}", 1},
      {plain + R"("camera": {"orbit": 90}, "lights": {"key_intensity": )" + key +
           "0.5}, {\"frame\": 4, \"value\": ",
       "}]}}", 3},
      // Where balls in flight are framed, too, all frames count as changed.
      {retarget + moving, "}]}}", 1}};
  const std::vector<int> numbers{1, 2, 3, 4};
  for (const Case& c : cases) {
    const Scene one = scene_of(c.before + "2" + c.after),
                other = scene_of(c.before + "3" + c.after);
    SequenceSettings s = settings(1, 4);
    s.existing = Existing::kOverwrite;
    ASSERT_TRUE(render_sequence(one, s, nullptr).ok());
    FrameFiles files;
    files.exr = s.exr;
    const auto same = expected_hashes(one, numbers), changed = expected_hashes(other, numbers);
    ASSERT_TRUE(same.ok() && changed.ok());
    EXPECT_EQ(frame_states(files, numbers, *same), std::vector<FileState>(4, FileState::kCurrent));
    // What status calls stale is what a render does again.
    const auto states = frame_states(files, numbers, *changed);
    s.existing = Existing::kSkip;
    const auto report = render_sequence(other, s, nullptr);
    ASSERT_TRUE(report.ok());
    for (int f = 1; f <= 4; ++f) {
      const auto at = static_cast<std::size_t>(f - 1);
      EXPECT_EQ(states[at] == FileState::kStale, f >= c.first) << c.before << f;
      EXPECT_EQ(report->frames[at].state == FrameRecord::State::kSkipped, f < c.first) << f;
    }
  }
}

TEST_F(FilmTest, HeldFramesAreTracedOnce) {
  const std::string held = kMorph + std::string(R"(, "frames": {"count": 8, "hold_start": 3})");
  Scene scene = scene_of(held);
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    SequenceSettings s = settings(1, 6);
    s.existing = Existing::kOverwrite;
    std::vector<int> order;
    const auto report = render_sequence(
        scene, s,
        [&](std::size_t, std::size_t, const FrameRecord& r) { order.push_back(r.frame); });
    ASSERT_TRUE(report.ok());
    EXPECT_EQ(order, (std::vector<int>{1, 2, 3, 4, 5, 6}));
    for (const FrameRecord& record : report->frames) {
      EXPECT_EQ(record.state, FrameRecord::State::kDone);
      EXPECT_EQ(record.trace_seconds == 0, record.frame >= 2 && record.frame <= 4) << record.frame;
    }
    for (int f = 2; f <= 4; ++f) {
      EXPECT_EQ(frame(f).pixels, frame(1).pixels);
      EXPECT_EQ(header(frame(f), "polymorph/frame"), std::to_string(f));
    }
    EXPECT_NE(frame(5).pixels, frame(1).pixels);
  }
  // As a frame by itself is.
  const Image together = frame(3);
  SequenceSettings alone = settings(3, 3);
  alone.existing = Existing::kOverwrite;
  ASSERT_TRUE(render_sequence(scene, alone, nullptr).ok());
  EXPECT_EQ(frame(3).pixels, together.pixels);
  EXPECT_EQ(header(frame(3), "polymorph/stage"), header(together, "polymorph/stage"));
  // Noise that is not steady makes them all different.
  scene.image.steady = false;
  SequenceSettings s = settings(1, 2);
  s.existing = Existing::kOverwrite;
  ASSERT_TRUE(render_sequence(scene, s, nullptr).ok());
  EXPECT_NE(frame(1).pixels, frame(2).pixels);
}

TEST_F(FilmTest, ATurntableShowsOneFrameFromAllSides) {
  const Scene scene =
      scene_of(kMorph + std::string(R"(, "frames": {"count": 8, "turntable": 4, "still": 5})"));
  ASSERT_EQ(frame_count(scene), 4);
  const auto report = render_sequence(scene, settings(1, 4), nullptr);
  ASSERT_TRUE(report.ok()) << report.error().message;
  for (const FrameRecord& record : report->frames)
    EXPECT_EQ(record.digest, report->frames[0].digest);
  EXPECT_FALSE(report->frames[0].digest.empty());
  EXPECT_NE(frame(1).pixels, frame(2).pixels);
  const auto prepared = prepare_scene(scene, *engine, {shared_cache()});
  ASSERT_TRUE(prepared.ok());
  const Vec3 first = make_frame_view(*prepared, 1).camera.forward,
             third = make_frame_view(*prepared, 3).camera.forward;
  EXPECT_NEAR(first.x, -third.x, 1e-5f);
  EXPECT_NEAR(first.y, third.y, 1e-5f);
  Scene beyond = scene;
  beyond.frames.still = 9;
  EXPECT_FALSE(prepare_scene(beyond, *engine, {}).ok());
}

TEST_F(FilmTest, JobsFillTheThreads) {
  set_thread_count(16);
  EXPECT_EQ(cpu_jobs(1920, 1080, 100), 1);
  EXPECT_GT(cpu_jobs(320, 240, 100), 1);
  EXPECT_LE(cpu_jobs(16, 16, 100), 16);
  EXPECT_EQ(cpu_jobs(16, 16, 1), 1);
}

TEST(JobsForDevices, AreTwoToFourEachByThreads) {
  set_thread_count(16);
  EXPECT_EQ(gpu_jobs(1), 4);
  EXPECT_EQ(gpu_jobs(2), 8);
  EXPECT_EQ(gpu_jobs(5), 15);
  EXPECT_EQ(gpu_jobs(16), 32);
  set_thread_count(0);
}

}  // namespace
}  // namespace polymorph
