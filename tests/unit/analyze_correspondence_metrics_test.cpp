#include "analyze/correspondence_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "analyze/measure.h"
#include "testing/analyze.h"

namespace polymorph {
namespace {

Analysis analyze(const std::vector<Mesh>& meshes) {
  std::vector<MorphFrame> frames;
  for (std::size_t k = 0; k < meshes.size(); ++k) {
    const double time = static_cast<double>(k) / static_cast<double>(meshes.size() - 1);
    frames.push_back({time, time, meshes[k], {}});
  }
  MorphEnds ends;
  ends.source = meshes.front();
  ends.target = meshes.back();
  return analyze_morph(ends, frames);
}

TEST(BodyMetrics, TellWhatABoxLosesOnItsWay) {
  // Two boxes become one of half the width that hovers, and then sinks: the hull's line is 3 all
  // the way, the height 1.
  Mesh two = box_mesh({0, 0, 0}, {1, 1, 1});
  const Mesh second = box_mesh({2, 0, 0}, {3, 1, 1});
  for (const Triangle& t : second.triangles)
    two.triangles.push_back({{t.v[0] + 8, t.v[1] + 8, t.v[2] + 8}});
  two.positions.insert(two.positions.end(), second.positions.begin(), second.positions.end());
  const Analysis analysis = analyze(
      {two, box_mesh({0, 0.25f, 0}, {1.5f, 1, 1}), box_mesh({0, -0.125f, 0}, {3, 1, 1}), two});
  EXPECT_NEAR(value(analysis, "hull_dip"), 1.5 * 0.75 / 3, 1e-6);
  EXPECT_NEAR(value(analysis, "floating"), 0.25, 1e-6);
  EXPECT_NEAR(value(analysis, "sinking"), 0.125, 1e-6);
  EXPECT_FALSE(analysis.find("distortion")->value);
  EXPECT_NEAR(analysis.frames[1].hull, 1.125, 1e-6);
  EXPECT_NEAR(analysis.frames[2].lowest, -0.125, 1e-6);
  EXPECT_NEAR(analysis.frames[2].height, 1.125, 1e-6);
}

TEST(BodyMetrics, TakeTheLineBetweenEndsOfDifferentHeight) {
  // A box that rises and grows evenly neither floats nor sinks, nor does it lose anything.
  std::vector<Mesh> frames;
  for (const float u : {0.0f, 0.5f, 1.0f}) frames.push_back(box_mesh({0, u, 0}, {1 + u, 1 + u, 1}));
  const Analysis analysis = analyze(frames);
  EXPECT_NEAR(value(analysis, "hull_dip"), 1, 1e-6);
  EXPECT_NEAR(value(analysis, "floating"), 0, 1e-6);
  EXPECT_NEAR(value(analysis, "sinking"), 0, 1e-6);
  // Of the last box's six faces the four along x are stretched by two, which have 4 of 6 and 8 of
  // 10 of the area.
  EXPECT_NEAR(value(analysis, "distortion"), 1 + (4.0 / 6 + 8.0 / 10) / 2, 1e-5);
  EXPECT_NEAR(*analysis.frames.front().distortion, 1, 1e-12);
}

Analysis judged(const TrueErrors& errors) {
  MorphEnds ends;
  ends.true_errors = errors;
  ends.facing = 12;
  ends.registration = 0.25;
  Analysis analysis;
  add_correspondence_metrics(ends, analysis);
  return analysis;
}

TEST(CorrespondenceMetrics, CountAndAverageTheErrors) {
  TrueErrors errors;
  errors.points = 2;
  errors.plan = {0.01, 0.04, 0.08, 0.27};
  errors.map = {0.05, 0.1, 0.2, 0.4};
  errors.geodesic = {0.1, 0.4};
  errors.facing = 90;
  const Analysis analysis = judged(errors);
  EXPECT_EQ(value(analysis, "points"), 2);
  EXPECT_EQ(value(analysis, "plan_within_5"), 0.5);
  EXPECT_EQ(value(analysis, "plan_within_10"), 0.75);
  EXPECT_NEAR(value(analysis, "plan_error"), 0.1, 1e-12);
  EXPECT_EQ(value(analysis, "map_within_5"), 0.25);
  EXPECT_EQ(value(analysis, "map_within_10"), 0.5);
  EXPECT_NEAR(value(analysis, "map_error"), 0.1875, 1e-12);
  EXPECT_EQ(value(analysis, "map_geodesic"), 0.25);
  EXPECT_EQ(value(analysis, "true_facing"), 90);
  EXPECT_EQ(value(analysis, "facing"), 12);
  EXPECT_EQ(value(analysis, "registration"), 0.25);
}

TEST(CorrespondenceMetrics, AreEmptyWhereNothingIsKnown) {
  TrueErrors errors;
  errors.points = 3;
  errors.geodesic = {0.1, std::numeric_limits<double>::infinity()};
  for (const char* name :
       {"plan_within_5", "plan_error", "map_within_10", "map_geodesic", "true_facing"})
    EXPECT_FALSE(judged(errors).find(name)->value) << name;
  Analysis unknown;
  add_correspondence_metrics({}, unknown);
  for (const Metric& metric : unknown.metrics) EXPECT_FALSE(metric.value) << metric.name;
}

}  // namespace
}  // namespace polymorph
