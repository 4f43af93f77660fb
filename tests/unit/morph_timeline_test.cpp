#include "morph/timeline.h"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

namespace polymorph {
namespace {

Scene scene_with(std::vector<bool> metas, int count = 0) {
  Scene scene;
  scene.actors[0].source.shape = scene.actors[0].target.shape = "sphere";
  for (const bool meta : metas) {
    ObjectSettings object;
    object.shape = "cube";
    object.meta = meta;
    object.motion.interpolate = Interpolation::kBalls;
    scene.actors[0].intermediate.push_back(object);
  }
  scene.frames.count = count;
  // With all of the report's stages.
  scene.actors[0].target.motion.interpolate = Interpolation::kBalls;
  scene.look.kind = LookKind::kMetal;
  return scene;
}

Timeline timeline_of(const Scene& scene) { return make_timeline(scene, scene.actors[0]); }

TEST(Timeline, GoesOnBetweenFrames) {
  const Timeline timeline = timeline_of(scene_with({false}, 9)),
                 fine = timeline_of(scene_with({false}, 33));
  for (int k = 0; k <= 32; ++k) {
    const MorphState between = morph_state_at(timeline, 1 + k / 4.0),
                     whole = morph_state_at(fine, 1 + k);
    EXPECT_EQ(between.stage, whole.stage) << k;
    EXPECT_EQ(between.leg, whole.leg) << k;
    EXPECT_NEAR(between.time, whole.time, 1e-6) << k;
    EXPECT_NEAR(between.boundary, whole.boundary, 1e-5) << k;
    EXPECT_EQ(between.frame, 1 + k / 4);
  }
}

TEST(Timeline, OwnLooksHaveNothingToFadeTo) {
  Scene scene = scene_with({false, true}, 60);
  scene.look.kind = LookKind::kOwn;
  const Timeline timeline = timeline_of(scene);
  int whole = 0;
  for (int frame = 1; frame <= 60; ++frame) {
    const MorphState m = morph_state_at(timeline, frame);
    EXPECT_TRUE(m.stage != Stage::kLookOut && m.stage != Stage::kLookIn);
    EXPECT_EQ(m.look, 0);
    whole += m.object >= 0 && m.boundary == 1;
  }
  EXPECT_EQ(whole, 3) << "source, the full object on the way, target: one frame each";
}

TEST(Timeline, StartsAsTheWholeSourceAndEndsAsTheWholeTarget) {
  for (const int count : {2, 3, 24, 100}) {
    const Timeline timeline = timeline_of(scene_with({true}, count));
    const MorphState first = morph_state_at(timeline, 1), last = morph_state_at(timeline, count);
    EXPECT_EQ(first.stage, Stage::kLookOut);
    EXPECT_EQ(first.object, 0);
    EXPECT_EQ(first.look, 0);
    EXPECT_EQ(first.boundary, 1);
    EXPECT_EQ(first.growth, 0);
    EXPECT_EQ(last.stage, Stage::kLookIn) << count;
    EXPECT_EQ(last.object, 2);
    EXPECT_EQ(last.look, 0);
    EXPECT_EQ(last.boundary, 1);
  }
}

TEST(Timeline, StagesFollowTheReportsOrder) {
  const Timeline timeline = timeline_of(scene_with({}, 200));
  int before = 0;
  std::set<Stage> seen;
  for (int frame = 1; frame <= 200; ++frame) {
    const MorphState moment = morph_state_at(timeline, frame);
    EXPECT_GE(static_cast<int>(moment.stage), before);
    before = static_cast<int>(moment.stage);
    seen.insert(moment.stage);
  }
  EXPECT_EQ(seen.size(), stage_table().size());
}

TEST(Timeline, MetaObjectsAreOnlyPassedThroughAsBalls) {
  const Timeline timeline = timeline_of(scene_with({true}, 200));
  for (int frame = 1; frame <= 200; ++frame) EXPECT_NE(morph_state_at(timeline, frame).object, 1);
  const Timeline full = timeline_of(scene_with({false}, 200));
  bool whole = false;
  for (int frame = 1; frame <= 200; ++frame) {
    const MorphState moment = morph_state_at(full, frame);
    whole |= moment.object == 1 && moment.look == 0 && moment.boundary == 1;
  }
  EXPECT_TRUE(whole) << "an object that is not meta has one frame wholly in its own look";
}

TEST(Timeline, NothingJumpsBetweenStages) {
  const Timeline timeline = timeline_of(scene_with({false, true}, 3000));
  for (int frame = 1; frame < 3000; ++frame) {
    const MorphState a = morph_state_at(timeline, frame), b = morph_state_at(timeline, frame + 1);
    if (a.leg != b.leg) continue;
    EXPECT_NEAR(a.u, b.u, 0.01);
    if (a.object == b.object && a.object >= 0) {
      EXPECT_NEAR(a.look, b.look, 0.06);
      EXPECT_NEAR(a.boundary, b.boundary, 0.06);
    }
    EXPECT_NEAR(a.growth, b.growth, a.object == b.object ? 0.06 : 0.01) << frame;
  }
}

TEST(Timeline, DistancesStartFromTheModelItself) {
  Scene scene = scene_with({false}, 60);
  ActorSettings& actor = scene.actors[0];
  actor.intermediate[0].motion.interpolate = actor.target.motion.interpolate =
      Interpolation::kDistance;
  scene.look.kind = LookKind::kOwn;
  const Timeline timeline = timeline_of(scene);
  int models = 0;
  for (int frame = 1; frame <= 60; ++frame) {
    const MorphState m = morph_state_at(timeline, frame);
    EXPECT_NE(m.stage, Stage::kBoundaryOut);
    EXPECT_NE(m.stage, Stage::kBoundaryIn);
    models += m.object >= 0;
  }
  EXPECT_EQ(models, 3) << "source, the full object on the way, target: one frame each";
}

TEST(Timeline, WhatComesApartIntoBallsIsMadeOfThem) {
  const auto distance = [](const Scene& scene) {
    return timeline_of(scene).legs[0].interpolation == Interpolation::kDistance;
  };
  Scene scene = scene_with({}, 60);
  EXPECT_FALSE(distance(scene));
  scene.actors[0].target.motion.interpolate = Interpolation::kDistance;
  EXPECT_TRUE(distance(scene));
  scene.actors[0].target.motion.path = Path::kExplode;
  EXPECT_FALSE(distance(scene));
  scene.actors[0].target.motion.path = Path::kParts;
  EXPECT_TRUE(distance(scene));
  scene.actors[0].source.shape = "drops";
  EXPECT_FALSE(distance(scene));
  scene.actors[0].source.shape = "sphere";
  scene.field.kind = FieldKind::kInverseSquare;
  EXPECT_FALSE(distance(scene));
}

TEST(Timeline, HoldsStandStill) {
  Scene scene = scene_with({}, 20);
  scene.frames.hold_start = 3;
  scene.frames.hold_end = 4;
  const Timeline timeline = timeline_of(scene);
  for (int frame = 1; frame <= 4; ++frame) EXPECT_EQ(morph_state_at(timeline, frame).t, 0) << frame;
  EXPECT_GT(morph_state_at(timeline, 5).t, 0);
  for (int frame = 16; frame <= 20; ++frame)
    EXPECT_EQ(morph_state_at(timeline, frame).t, 1) << frame;
  EXPECT_LT(morph_state_at(timeline, 15).t, 1);
}

TEST(Timeline, LegsTakeTheFramesTheyAreGiven) {
  Scene scene = scene_with({true});
  scene.frames.per_leg = {10, 30};
  const Timeline timeline = timeline_of(scene);
  EXPECT_EQ(timeline.count, 40);
  int first = 0;
  for (int frame = 1; frame <= 40; ++frame) first += morph_state_at(timeline, frame).leg == 0;
  EXPECT_NEAR(first, 10, 1);
  scene.frames.per_leg.clear();
  EXPECT_EQ(timeline_of(scene).count, 48);
}

TEST(Timeline, ACutHasNoBoundaryStages) {
  Scene scene = scene_with({}, 200);
  scene.boundary.method = BoundaryMethod::kCut;
  const Timeline timeline = timeline_of(scene);
  for (int frame = 1; frame <= 200; ++frame) {
    const Stage stage = morph_state_at(timeline, frame).stage;
    EXPECT_TRUE(stage != Stage::kBoundaryOut && stage != Stage::kBoundaryIn);
  }
}

TEST(Timeline, ACutWithoutFadesStillShowsTheModels) {
  Scene scene = scene_with({}, 20);
  scene.boundary.method = BoundaryMethod::kCut;
  scene.boundary.look_share = 0;
  const Timeline timeline = timeline_of(scene);
  const MorphState first = morph_state_at(timeline, 1), second = morph_state_at(timeline, 2),
                   last = morph_state_at(timeline, 20);
  EXPECT_EQ(first.object, 0);
  EXPECT_EQ(first.look, 0);
  EXPECT_EQ(second.object, -1);
  EXPECT_EQ(last.object, 1);
  EXPECT_EQ(last.boundary, 1);
}

TEST(Timeline, AnObjectOnTheWayMayStandStillAndHaveItsOwnMotion) {
  Scene scene = scene_with({false, true});
  scene.frames.per_leg = {10, 10, 10};
  scene.actors[0].intermediate[0].hold = 5;
  scene.actors[0].intermediate[1].hold = 3;
  scene.actors[0].target.motion.easing = Easing::kLinear;
  const Timeline timeline = timeline_of(scene);
  EXPECT_EQ(timeline.count, 38);
  int whole = 0, balls = 0;
  float before = -1;
  for (int frame = 1; frame <= timeline.count; ++frame) {
    const MorphState m = morph_state_at(timeline, frame);
    whole += m.object == 1 && m.boundary == 1 && m.look == 0;
    balls += m.object == -1 && static_cast<float>(m.leg) + m.time == 2;
    const float place = static_cast<float>(m.leg) + m.time;
    EXPECT_GE(place, before) << "nothing goes back";
    before = place;
  }
  EXPECT_EQ(whole, 6);
  EXPECT_EQ(balls, 4) << "a meta-object stands still as its balls";
  MorphState middle;
  for (int frame = 1; middle.leg < 2 || middle.time < 0.2f; ++frame)
    middle = morph_state_at(timeline, frame);
  EXPECT_EQ(middle.u, middle.time) << "linear";
  scene.frames.per_leg.clear();
  scene.frames.count = 9;  // not enough to stand still in
  const Timeline few = timeline_of(scene);
  EXPECT_EQ(few.count, 9);
  EXPECT_EQ(morph_state_at(few, 9).object, 3);
}

TEST(Timeline, FewerFramesThanLegsStillEndAtTheTarget) {
  for (const int count : {2, 3, 4}) {
    const Timeline timeline = timeline_of(scene_with({true, true, true, true}, count));
    EXPECT_EQ(morph_state_at(timeline, 1).object, 0) << count;
    EXPECT_EQ(morph_state_at(timeline, count).object, 5) << count;
  }
}

TEST(Timeline, SharesThatLeaveNoTimeAreScaledDown) {
  Scene scene = scene_with({}, 100);
  scene.boundary.look_share = scene.boundary.boundary_share = 0.4f;
  const Timeline timeline = timeline_of(scene);
  EXPECT_NEAR(timeline.legs[0].shares[2], 0.2, 1e-5);
}

TEST(Timeline, EveryActorHasItsOwnTimeInTheScenesFrames) {
  Scene scene = scene_with({});
  scene.look.kind = LookKind::kOwn;
  scene.frames.hold_start = 3;
  scene.frames.hold_end = 2;
  scene.actors.push_back(scene.actors[0]);
  scene.actors[1].start = 11;
  scene.actors[1].per_leg = {30};
  EXPECT_EQ(frame_count(scene), 3 + 10 + 30 + 2) << "as many as the last one needs";
  const Timeline first = make_timeline(scene, scene.actors[0]),
                 second = make_timeline(scene, scene.actors[1]);
  for (int frame = 1; frame <= 45; ++frame) {
    const MorphState one = morph_state_at(first, frame), two = morph_state_at(second, frame);
    EXPECT_EQ(one.t == 0, frame <= 4) << frame;
    EXPECT_EQ(one.t == 1, frame >= 3 + 24) << frame;
    EXPECT_EQ(two.t == 0, frame <= 14) << frame;
    EXPECT_EQ(two.t == 1, frame >= 3 + 10 + 30) << frame;
  }
  EXPECT_EQ(sequence_time(scene, 4), 0);
  EXPECT_EQ(sequence_time(scene, 43), 1);
  EXPECT_EQ(sequence_time(scene, 45), 1);
  // With a count, those without per_leg move until the scene ends.
  scene.frames.count = 50;
  EXPECT_EQ(frame_count(scene), 50);
  EXPECT_LT(morph_state_at(make_timeline(scene, scene.actors[0]), 47).t, 1);
  EXPECT_EQ(morph_state_at(make_timeline(scene, scene.actors[0]), 48).t, 1);
  EXPECT_EQ(morph_state_at(make_timeline(scene, scene.actors[1]), 43).t, 1);
}

/// A scene of five frames whose first object gives all its weight to the last. `count`: of objects.
Scene blend_scene(std::size_t count) {
  Scene scene;
  scene.frames.count = 5;
  scene.look.kind = LookKind::kOwn;
  for (std::size_t i = 0; i < count; ++i) {
    ObjectSettings object;
    object.shape = "cube";
    object.weight = 0.0f;
    scene.actors[0].blend.push_back(object);
  }
  for (const auto& [object, first, last] :
       {std::tuple(std::size_t{0}, 3.0f, 0.0f), std::tuple(count - 1, 0.0f, 3.0f)})
    scene.tracks.push_back({"/actors/0/blend/" + std::to_string(object) + "/weight",
                            KeyUnit::kFrame,
                            KeyEasing::kLinear,
                            {{1, {first, 0, 0}}, {5, {last, 0, 0}}}});
  return scene;
}

TEST(Timeline, OfTwoBlendedObjectsTheSecondsWeightIsTheTime) {
  const Timeline timeline = timeline_of(blend_scene(2));
  ASSERT_EQ(timeline.legs.size(), 1u);
  EXPECT_FALSE(mixes_many(timeline));
  for (int frame = 1; frame <= 5; ++frame) {
    const MorphState moment = morph_state_at(timeline, frame);
    EXPECT_FLOAT_EQ(moment.time, static_cast<float>(frame - 1) / 4);
    EXPECT_EQ(moment.u, moment.time) << "whatever the scene's easing";
    EXPECT_TRUE(moment.weights.empty());
    EXPECT_EQ(moment.object, frame == 1 ? 0 : frame == 5 ? 1 : -1);
  }
  EXPECT_FLOAT_EQ(morph_state_at(timeline, 2.5).time, 0.375f);
}

TEST(Timeline, ManyBlendedObjectsHaveWeightsAndTheOneWithAllOfThemShows) {
  const Scene scene = blend_scene(4);
  const Timeline timeline = timeline_of(scene);
  EXPECT_TRUE(mixes_many(timeline));
  EXPECT_EQ(timeline.legs.size(), 3u);
  EXPECT_FALSE(find_weightless_frame(timeline));
  const MorphState first = morph_state_at(timeline, 1), last = morph_state_at(timeline, 5),
                   middle = morph_state_at(timeline, 3);
  EXPECT_EQ(first.object, 0);
  EXPECT_EQ(first.leg, 0);
  EXPECT_EQ(last.object, 3);
  EXPECT_EQ(last.leg, 2) << "the leg that ends at it";
  EXPECT_EQ(middle.object, -1);
  EXPECT_EQ(middle.stage, Stage::kBlend);
  EXPECT_EQ(middle.weights, (std::vector<float>{0.5f, 0, 0, 0.5f}));
  EXPECT_EQ(morph_state_at(timeline, 2.5).weights, (std::vector<float>{0.625f, 0, 0, 0.375f}));
  EXPECT_TRUE(differs_from_neighbours(timeline, 3));
  EXPECT_DOUBLE_EQ(film_time(scene, 3).leg, 1.5) << "to keyframes a blend is one leg";
  Scene zero = scene;
  zero.tracks[1].keys[1].value = {};
  EXPECT_EQ(find_weightless_frame(timeline_of(zero)), 5);
}

}  // namespace
}  // namespace polymorph
