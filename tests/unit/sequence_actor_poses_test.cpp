#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analyze/measure.h"
#include "film/render_sequence.h"
#include "film/status.h"
#include "image/image_io.h"
#include "inspect/analyze_sequence.h"
#include "leg/leg_surface.h"
#include "morph/timeline.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/prepare/actor_poses.h"
#include "sequence/prepare/film_settings.h"
#include "spheres/quality.h"
#include "testing/scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// A body with an arm along x that is raised by an angle; `rings` and `sides` say of how many
/// faces. Quadrangles are bent, and cut otherwise in each pose.
std::string waving(double angle, int rings = 20, int sides = 24, bool quadrangles = false) {
  std::string text = "o body\n";
  const auto point = [&](double ring, double side) {
    const double polar = std::numbers::pi * ring / rings,
                 azimuth = 2 * std::numbers::pi * side / sides;
    double x = std::sin(polar) * std::cos(azimuth), y = std::cos(polar);
    const double z = std::sin(polar) * std::sin(azimuth);
    const double reach = 1 + 1.6 * std::exp(-14 * (1 - x));
    x *= reach, y *= reach;
    const double t = std::clamp((x - 0.8) / 0.6, 0.0, 1.0), turn = angle * t * t * (3 - 2 * t);
    const double along = x - 0.8;
    text +=
        fmt::format("v {:.6f} {:.6f} {:.6f}\n", 0.8 + along * std::cos(turn) - y * std::sin(turn),
                    along * std::sin(turn) + y * std::cos(turn), reach * z);
  };
  for (int r = 1; r < rings; ++r)
    for (int s = 0; s < sides; ++s) point(r, s);
  point(0, 0);
  point(rings, 0);
  const int north = (rings - 1) * sides + 1, south = north + 1;
  const auto at = [&](int r, int s) { return (r - 1) * sides + s % sides + 1; };
  for (int s = 0; s < sides; ++s) {
    text += fmt::format("f {} {} {}\nf {} {} {}\n", north, at(1, s + 1), at(1, s), south,
                        at(rings - 1, s), at(rings - 1, s + 1));
    for (int r = 1; r + 1 < rings; ++r) {
      const int a = at(r, s), b = at(r, s + 1), c = at(r + 1, s + 1), d = at(r + 1, s);
      text += quadrangles ? fmt::format("f {} {} {} {}\n", a, b, c, d)
                          : fmt::format("f {0} {1} {2}\nf {0} {2} {3}\n", a, b, c, d);
    }
  }
  return text;
}

constexpr int kPoses = 8;  // of a cycle

class MovingEndsTest : public SceneTest {
 protected:
  MovingEndsTest() : SceneTest(kCommon) {
    for (int k = 1; k <= kPoses; ++k) write_pose(k, waving(angle_of(k)));
  }
  static double angle_of(int k) { return 0.9 * std::sin(2 * std::numbers::pi * (k - 1) / kPoses); }
  void write_pose(int number, const std::string& text) {
    ASSERT_TRUE(write_file(folder / fmt::format("a.{:04}.obj", number), text).ok());
  }
  SequenceSettings settings(std::vector<int> frames) {
    SequenceSettings s;
    s.frames = std::move(frames);
    s.exr = *parse_pattern((folder / "f.####.exr").string());
    s.device = "cpu";
    s.cache_folder = shared_cache();
    s.existing = Existing::kSkip;
    return s;
  }
  RunReport rendered(const Scene& scene, const SequenceSettings& given) {
    const auto report = render_sequence(scene, given, {});
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return report.ok() ? *report : RunReport{};
  }
  std::vector<float> pixels(int number) {
    const auto image = read_image(folder / fmt::format("f.{:04}.exr", number));
    EXPECT_TRUE(image.ok());
    return image.ok() ? image->pixels : std::vector<float>{};
  }
  std::shared_ptr<const Leg> leg_of(const PreparedScene& prepared, int frame) {
    auto leg = leg_at(prepared.actors[0], 0, frame, *engine);
    EXPECT_TRUE(leg.ok()) << (leg.ok() ? "" : leg.error().message);
    return leg.ok() ? *leg : nullptr;
  }

  // Two still frames, twelve that move, two still ones.
  static constexpr const char* kCommon =
      R"("image": {"width": 32, "height": 24, "samples": 2, "max_depth": 2, "aovs": "none",
                   "steady": true},
         "frames": {"count": 16, "hold_start": 2, "hold_end": 2}, "surface": {"resolution": 32},
         "spheres": {"balls": 24}, "ground": {"height": -2}, "arrange": "none",
         "camera": {"position": [3, 2, 8], "target": [0.5, 0, 0]})";
  static constexpr const char* kMoving =
      R"("source": {"model": "a.####.obj", "loop": true},
         "target": {"model": "a.####.obj", "loop": true, "scale": [0.9, 0.8, 0.9]})";
};

TEST_F(MovingEndsTest, PosesGoOnThroughHoldsAndMorph) {
  const Scene scene = scene_of(
      R"("source": {"model": "a.####.obj", "loop": true}, "target": {"model": "a.####.obj", "fps": 12})");
  const Timeline timeline = make_timeline(scene, scene.actors[0]);
  std::string from, to;
  for (int f = 1; f <= frame_count(scene); ++f) {
    const MorphState moment = morph_state_at(timeline, f);
    from += std::to_string(moment.mesh + 1);
    to += std::to_string(moment.to_mesh + 1);
    EXPECT_EQ(moment.object, f <= 3 ? 0 : f >= 14 ? 1 : -1) << f;
    EXPECT_EQ(differs_from_neighbours(timeline, f), f < 15) << f;
  }
  EXPECT_EQ(from, "1234567812345678");
  EXPECT_EQ(to, "1122334455667788");
}

TEST_F(MovingEndsTest, EndsAreThePosesToTheBit) {
  // Turned about the middle of its box the target has the box of the source.
  const std::vector<int> frames{1, 2, 3, 14, 16};
  const std::string place = R"(, "loop": true, "scale": [1, 1, -1]})";
  const auto render_all = [&](const Scene& scene) {
    rendered(scene, settings(frames));
    std::vector<std::vector<float>> pictures;
    for (const int f : frames) {
      pictures.push_back(pixels(f));
      fs::remove(folder / fmt::format("f.{:04}.exr", f));
    }
    return pictures;
  };
  const auto moving = render_all(scene_of(
      R"("source": {"model": "a.####.obj", "loop": true}, "target": {"model": "a.####.obj")" +
      place));
  // A still render of a pose is a frame of the sequence that plays alone.
  const auto alone = [&](const std::string& keys) {
    Scene scene = scene_of(R"("source": {"model": "a.####.obj")" + keys);
    scene.frames.hold_start = scene.frames.hold_end = 0;
    return render_all(scene);
  };
  const auto source = alone(R"(, "loop": true})"), target = alone(place);
  for (const std::size_t i : {0u, 1u, 2u}) EXPECT_TRUE(moving[i] == source[i]) << frames[i];
  for (const std::size_t i : {3u, 4u}) EXPECT_TRUE(moving[i] == target[i]) << frames[i];
  EXPECT_FALSE(moving[0] == moving[1]);
  EXPECT_FALSE(moving[3] == source[3]);
}

TEST_F(MovingEndsTest, ThePlanIsMadeOnceAndCarried) {
  const PreparedScene prepared = prepared_of(kMoving);
  const Leg& reference = *prepared.actors[0].legs[0];
  EXPECT_EQ(leg_of(prepared, 1), prepared.actors[0].legs[0]) << "the reference poses";
  const auto leg = leg_of(prepared, 7);
  ASSERT_TRUE(leg);
  EXPECT_EQ(leg->from->model.points.size(), reference.from->model.points.size());
  EXPECT_NE(leg->from->model.points, reference.from->model.points);
  ASSERT_EQ(leg->plan.pairs.size(), reference.plan.pairs.size());
  for (std::size_t e = 0; e < leg->plan.pairs.size(); ++e) {
    EXPECT_EQ(leg->plan.pairs[e].from, reference.plan.pairs[e].from);
    EXPECT_EQ(leg->plan.pairs[e].to, reference.plan.pairs[e].to);
  }
  EXPECT_EQ(leg->plan.pacing, reference.plan.pacing);
  EXPECT_NE(leg->from->distances.key, reference.from->distances.key);
  // Balls in the arm go with it, those in the body stay.
  float farthest = 0, nearest = 1;
  for (std::size_t i = 0; i < leg->from->balls.size(); ++i) {
    const float step = length(leg->from->balls[i].center - reference.from->balls[i].center);
    if (reference.from->balls[i].center.x > 1.5f) farthest = std::max(farthest, step);
    if (reference.from->balls[i].center.x < 0) nearest = std::min(nearest, step);
  }
  EXPECT_GT(farthest, 0.4f);
  EXPECT_LT(nearest, 1e-2f);
}

TEST_F(MovingEndsTest, FewPosesAreKeptAtATime) {
  const PreparedScene prepared = prepared_of(kMoving);
  for (int f = 4; f < 14; ++f) {
    ASSERT_TRUE(geometry_at(prepared, *engine, f).ok());
    EXPECT_LE(prepared.actors[0].poses->cached.size(), 2u * kMaxCachedPoses);
  }
  const auto leg = leg_of(prepared, 13), again = leg_of(prepared, 13);
  EXPECT_EQ(leg->from, again->from) << "the same pose is not made twice";
}

TEST_F(MovingEndsTest, TheSurfaceStepsNoFartherThanItsEnds) {
  const PreparedScene prepared = prepared_of(kMoving);
  const auto analyses = analyze_scene(
      prepared, *engine, 0, [](int, int) { return true; }, nullptr);
  ASSERT_TRUE(analyses.ok()) << analyses.error().message;
  const Metric* step = analyses->front().find("pose_step");
  ASSERT_TRUE(step && step->value);
  EXPECT_LT(*step->value, 1.2);
  EXPECT_GT(*step->value, 0.5) << "it moves with its ends";
  // A morph of objects that stand still has no such step.
  const PreparedScene still = prepared_of(R"("source": "a.0001.obj", "target": "a.0003.obj")");
  const auto none = analyze_scene(
      still, *engine, 2, [](int, int) { return true; }, nullptr);
  ASSERT_TRUE(none.ok());
  EXPECT_FALSE(none->front().find("pose_step")->value);
}

TEST_F(MovingEndsTest, PointsMoveWithThePoses) {
  // One object's cycle becomes the same one's: what moves is the pose alone.
  Scene scene = scene_of(
      R"("source": {"model": "a.####.obj", "loop": true},
         "target": {"model": "a.####.obj", "loop": true, "name": "b"})");
  scene.camera.shutter = 0.5f;
  const auto made = prepare_scene(scene, *engine, {shared_cache()});
  ASSERT_TRUE(made.ok());
  const PreparedScene& prepared = *made;
  const auto geometry = geometry_at(prepared, *engine, 8);
  ASSERT_TRUE(geometry.ok());
  const ActorGeometry& shown = geometry->actors[0];
  const auto next = geometry_at(prepared, *engine, 9);
  ASSERT_TRUE(next.ok());
  ASSERT_EQ(shown.flow.displacement.size(), shown.surface.positions.size());
  Mesh moved = shown.surface;
  for (std::size_t i = 0; i < moved.positions.size(); ++i)
    moved.positions[i] = moved.positions[i] + shown.flow.displacement[i];
  const MeasuredSurface target(next->actors[0].surface);
  const double left = target.distance_to(MeasuredSurface(moved)).mean,
               step = target.distance_to(MeasuredSurface(shown.surface)).mean;
  EXPECT_LT(left, 0.35 * step);
}

TEST_F(MovingEndsTest, OnlyFramesThatShowAChangedPoseAreRenderedAgain) {
  const Scene scene =
      scene_of(R"("source": {"model": "a.####.obj", "loop": true}, "target": "cube")");
  std::vector<int> frames;
  for (int f = 1; f <= 16; ++f) frames.push_back(f);
  const auto hashes = [&] {
    const auto expected = expected_hashes(scene, frames);
    EXPECT_TRUE(expected.ok());
    return expected.ok() ? expected->frames : std::vector<std::string>{};
  };
  const std::vector<std::string> before = hashes();
  write_pose(5, waving(0.05));
  const std::vector<std::string> after = hashes();
  for (std::size_t i = 0; i < frames.size(); ++i)  // frame 13 shows it for the second time
    EXPECT_EQ(before[i] != after[i], frames[i] == 5 || frames[i] == 13) << frames[i];
  // The morph is planned for the first pose: only the still frames before and after do not depend
  // on it.
  write_pose(5, waving(angle_of(5)));
  EXPECT_EQ(hashes(), before);
  write_pose(1, waving(0.05));
  const std::vector<std::string> replanned = hashes();
  for (std::size_t i = 3; i < 13; ++i) EXPECT_NE(before[i], replanned[i]) << frames[i];
  EXPECT_EQ(before[1], replanned[1]);
}

TEST_F(MovingEndsTest, AMissingPoseStopsOnlyFramesThatShowIt) {
  fs::remove(folder / "a.0006.obj");
  const Scene scene = scene_of(
      R"("source": {"model": "a.####.obj", "range": [1, 8], "loop": true}, "target": "a.0001.obj")");
  const auto refused = render_sequence(scene, settings({5, 6}), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("mesh 6: "), std::string::npos);
  EXPECT_EQ(rendered(scene, settings({14})).count(FrameRecord::State::kDone), 1u)
      << "it shows the target alone";
  SequenceSettings on = settings({5, 6});
  on.keep_going = true;
  const RunReport report = rendered(scene, on);
  EXPECT_EQ(report.count(FrameRecord::State::kDone), 1u);
  EXPECT_EQ(report.count(FrameRecord::State::kFailed), 1u);
}

TEST_F(MovingEndsTest, PosesWithOtherVerticesKeepTheirBalls) {
  for (int k = 3; k <= kPoses; ++k) write_pose(k, waving(angle_of(k), 20 + k, 24 + k));
  const PreparedScene prepared = prepared_of(
      R"("source": {"model": "a.####.obj", "loop": true}, "target": {"model": "a.0001.obj"})");
  const auto carried = leg_of(prepared, 2), before = leg_of(prepared, 5),
             after = leg_of(prepared, 6);
  ASSERT_TRUE(carried && before && after);
  ASSERT_EQ(before->from->balls.size(), after->from->balls.size());
  for (std::size_t i = 0; i < after->from->balls.size(); ++i)
    EXPECT_LT(length(after->from->balls[i].center - before->from->balls[i].center), 0.9f) << i;
  const Model& pose = after->from->model;
  EXPECT_NEAR(after->from->ball_volume, solid_volume(pose, InsideTest(pose)),
              0.03 * after->from->ball_volume);
  // A frame alone has the same poses as one in its sequence.
  const PreparedScene again = prepared_of(
      R"("source": {"model": "a.####.obj", "loop": true}, "target": {"model": "a.0001.obj"})");
  EXPECT_EQ(leg_of(again, 6)->from->balls[0].center, after->from->balls[0].center);
  EXPECT_TRUE(geometry_at(prepared, *engine, 8).ok());
}

TEST_F(MovingEndsTest, BentQuadranglesCorrespondHoweverTheyAreCut) {
  for (int k = 1; k <= kPoses; ++k) write_pose(k, waving(angle_of(k), 20, 24, true));
  const PreparedScene prepared =
      prepared_of(R"("source": {"model": "a.####.obj", "loop": true}, "target": "cube")");
  const MeshSequence& sequence = *prepared.actors[0].poses->objects[0].sequence;
  EXPECT_NE(sequence.files[2].topology, sequence.files[0].topology);
  const auto leg = leg_of(prepared, 3);
  ASSERT_TRUE(leg);
  EXPECT_FALSE(prepared.actors[0].poses->fits[0][2].has_value()) << "it was not fitted";
  EXPECT_EQ(leg->from->balls[0].w, prepared.actors[0].objects[0]->balls[0].w);
}

TEST_F(MovingEndsTest, LandmarksGoWithTheirPose) {
  const PreparedScene prepared = prepared_of(
      R"("source": {"model": "a.####.obj", "loop": true, "name": "moving"}, "target": {"shape": "sphere"},
         "plan": {"landmarks": {"moving": {"hand": [2.4, 0, 0]}, "sphere": {"hand": [1, 1, 0]}}})");
  const auto leg = leg_of(prepared, 3);
  ASSERT_TRUE(leg);
  const Vec3 place = leg->from->landmarks.at("hand"),
             was = prepared.actors[0].legs[0]->from->landmarks.at("hand");
  EXPECT_LT(std::fabs(was.y), 0.1f);
  EXPECT_GT(place.y, 0.8f) << "the arm is raised";
  EXPECT_EQ(leg->plan.landmarks[0].from, place);
}

TEST_F(MovingEndsTest, IntermediateObjectsAndBallsMoveToo) {
  const PreparedScene prepared = prepared_of(
      R"("source": "sphere", "intermediate": [{"model": "a.####.obj", "loop": true, "hold": 4}],
         "target": "cube", "motion": {"interpolate": "balls"}, "boundary": {"method": "crossfade"})");
  const Timeline& timeline = prepared.actors[0].timeline;
  int shown = 0;
  for (int f = 1; f <= prepared.frame_count; ++f) {
    const auto geometry = geometry_at(prepared, *engine, f);
    ASSERT_TRUE(geometry.ok()) << f << ": " << geometry.error().message;
    const MorphState moment = morph_state_at(timeline, f);
    if (moment.object != 1 || moment.boundary < 1) continue;
    ++shown;
    EXPECT_FALSE(geometry->actors[0].points.empty());
    const int mesh = moment.leg == 1 ? moment.mesh : moment.to_mesh;
    EXPECT_EQ(mesh, (f - 1) % kPoses);
  }
  EXPECT_GE(shown, 5);
  // Balls that show are fitted to the pose that they are carried to.
  const auto leg = leg_of(prepared, 4);
  const Model& pose = leg->to->model;
  EXPECT_NEAR(leg->to->ball_volume, solid_volume(pose, InsideTest(pose)),
              0.03 * leg->to->ball_volume);
}

TEST_F(MovingEndsTest, WhatCannotBeIsSaid) {
  EXPECT_TRUE(write_file(folder / "bad.json",
                         R"({"source": "a.####.obj", "target": "cube",
                             "intermediate": [{"shape": "sphere", "retarget": 0.5}]})")
                  .ok());
  const auto scene = load_scene(folder / "bad.json");
  ASSERT_FALSE(scene.ok());
  EXPECT_NE(scene.error().message.find("reaches all its objects"), std::string::npos)
      << scene.error().message;
}

}  // namespace
}  // namespace polymorph
