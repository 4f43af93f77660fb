#include "analyze/smoothness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "analyze/analysis_report.h"
#include "analyze/frame_measures.h"
#include "base/file.h"
#include "field/extract_surface.h"
#include "testing/analyze.h"
#include "testing/morph.h"
#include "testing/paths.h"

namespace polymorph {
namespace {

Mesh sphere(float radius) {
  const auto engine = make_cpu_engine();
  return extract_surface(*engine, BallSet{ball_at({}, radius)}, 0.1f, {}).value();
}

/// With a square plate of no thickness that sticks out of it.
Mesh with_wing(Mesh mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const float x : {0.9f, 1.6f})
    for (const float y : {-0.1f, 0.1f}) mesh.positions.push_back({x, y, 0});
  for (const auto& [a, b, c] : {std::tuple(0u, 2u, 1u), {1u, 2u, 3u}, {0u, 1u, 2u}, {1u, 3u, 2u}})
    mesh.triangles.push_back({{first + a, first + b, first + c}});
  return mesh;
}

/// A sphere that grows evenly in u, at even times that `ease` makes u of.
template <class Ease>
std::vector<MorphFrame> growing(int count, const Ease& ease) {
  std::vector<MorphFrame> frames;
  for (int k = 0; k < count; ++k) {
    MorphFrame frame;
    frame.time = static_cast<double>(k) / (count - 1);
    frame.u = ease(frame.time);
    frame.surface = sphere(0.8f + 0.4f * static_cast<float>(frame.u));
    frames.push_back(std::move(frame));
  }
  return frames;
}

double smoothstep(double t) { return t * t * (3 - 2 * t); }

MorphEnds ends_of(const std::vector<MorphFrame>& frames) {
  MorphEnds ends;
  ends.source = frames.front().surface;
  ends.target = frames.back().surface;
  return ends;
}

Analysis rough(const std::vector<Roughness>& frames) {
  Analysis analysis;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    FrameMeasures row;
    row.u = static_cast<double>(k) / static_cast<double>(frames.size() - 1);
    row.roughness = frames[k];
    analysis.frames.push_back(row);
  }
  add_roughness_metrics(analysis);
  return analysis;
}

TEST(RoughnessMetrics, CompareInnerFramesWithTheEnds) {
  const Analysis analysis = rough({{1, 0, 0, 0.1},
                                   {4, 5, 7, 9},
                                   {2, 3, 1, 0.1},
                                   {2, 2, 2, 0.2},
                                   {2.8, 1, 2, 9},
                                   {3, 2, 3, 0.2}});
  EXPECT_DOUBLE_EQ(value(analysis, "curvature"), 4 / 1.4);
  EXPECT_DOUBLE_EQ(value(analysis, "least_curvature"), 2 / 2.2);
  EXPECT_DOUBLE_EQ(value(analysis, "bumps"), 2);
  EXPECT_DOUBLE_EQ(value(analysis, "groove"), 2);
  EXPECT_DOUBLE_EQ(value(analysis, "detail"), (9 / 0.12 + 0.1 / 0.14 + 0.2 / 0.16 + 9 / 0.18) / 4);
}

TEST(RoughnessMetrics, AreNotMeasuredWithoutInnerFrames) {
  const Analysis analysis = rough({{1, 0, 0, 0.1}, {1, 0, 0, 0.1}});
  for (const char* name : {"curvature", "least_curvature", "bumps", "groove", "detail"})
    EXPECT_FALSE(analysis.find(name)->value) << name;
}

TEST(StepMetrics, OfAnEvenWayAreOneWhateverTheEasingAndTheFrames) {
  for (const int count : {9, 16}) {
    const auto linear = growing(count, [](double t) { return t; });
    const auto eased = growing(count, smoothstep);
    for (const auto& frames : {linear, eased}) {
      const Analysis analysis = analyze_morph(ends_of(frames), frames);
      EXPECT_NEAR(value(analysis, "first_step"), 1, 0.05) << count;
      EXPECT_NEAR(value(analysis, "last_step"), 1, 0.05) << count;
      EXPECT_NEAR(value(analysis, "source_step"), 0, 1e-3) << count;
      EXPECT_EQ(value(analysis, "parts"), 1);
    }
  }
}

TEST(StepMetrics, TellALateStart) {
  // All of the way in the second half.
  auto frames = growing(11, [](double t) { return std::max(0.0, 2 * t - 1); });
  for (MorphFrame& frame : frames) frame.u = frame.time;
  const Analysis analysis = analyze_morph(ends_of(frames), frames);
  EXPECT_NEAR(value(analysis, "first_step"), 0, 0.01);
  EXPECT_NEAR(value(analysis, "last_step"), 2, 0.1);
}

TEST(StepMetrics, AWingThatAppearsWholeIsAStep) {
  const auto frames = growing(11, [](double t) { return t; });
  MorphEnds ends = ends_of(frames);
  ends.source = with_wing(ends.source);
  const Analysis analysis = analyze_morph(ends, frames);
  // The Hausdorff distance of the wing's tip, 0.8, over steps of 0.04.
  EXPECT_NEAR(value(analysis, "source_step"), 20, 1.5);
  EXPECT_NEAR(value(analysis, "target_step"), 0, 1e-3);
  EXPECT_FALSE(reaches(value(analysis, "source_step"), analysis.find("source_step")->goal));
}

TEST(StepMetrics, AnObjectThatIsNotShownHasNone) {
  const auto frames = growing(5, smoothstep);
  MorphEnds ends = ends_of(frames);
  ends.source_shown = false;
  const Analysis analysis = analyze_morph(ends, frames);
  EXPECT_FALSE(analysis.find("source_step")->value);
  EXPECT_TRUE(analysis.find("target_step")->value);
}

TEST(Metrics, AreThoseOfEveryMorphAndOfThePage) {
  const auto frames = growing(3, smoothstep);
  std::vector<std::string> names;
  for (const Metric& metric : analyze_morph(ends_of(frames), frames).metrics)
    names.push_back(metric.name);
  EXPECT_EQ(names, metric_names());
  // docs/method.md defines them in the first table of its section, whose rows begin with names.
  const std::string page = read_file(source_dir() / "docs/method.md").value();
  const std::string quality = page.substr(page.find("\n## Quality\n"));
  const std::string table = quality.substr(quality.find("|---"), quality.find("\n\nLumps"));
  const std::regex first_cell("\n\\| ([a-z_0-9, ]+) \\|"), word("[a-z_0-9]+");
  std::multiset<std::string> defined;
  const std::sregex_iterator end;
  for (std::sregex_iterator row(table.begin(), table.end(), first_cell); row != end; ++row) {
    const std::string cell = (*row)[1];
    for (std::sregex_iterator name(cell.begin(), cell.end(), word); name != end; ++name)
      defined.insert(name->str());
  }
  std::vector<std::string> missing, unknown;  // of the page
  std::sort(names.begin(), names.end());
  std::set_difference(names.begin(), names.end(), defined.begin(), defined.end(),
                      std::back_inserter(missing));
  std::set_difference(defined.begin(), defined.end(), names.begin(), names.end(),
                      std::back_inserter(unknown));
  EXPECT_EQ(missing, std::vector<std::string>{});
  EXPECT_EQ(unknown, std::vector<std::string>{});
}

TEST(FrameMeasures, AreThoseOfThePage) {
  const std::string page = read_file(source_dir() / "docs/method.md").value();
  const std::string section = page.substr(page.find("**Measures of each frame**"));
  const std::string table = section.substr(section.find("|---"), section.find("\n\n**What"));
  const std::regex row("\n\\| ([a-z_]+) \\| (.+) \\|");
  std::vector<std::pair<std::string, std::string>> defined, expected;
  const std::sregex_iterator end;
  for (std::sregex_iterator match(table.begin(), table.end(), row); match != end; ++match)
    defined.emplace_back((*match)[1], (*match)[2]);
  for (const MeasureColumn& column : measure_columns())
    expected.emplace_back(column.name, column.definition);
  EXPECT_EQ(defined, expected);
}

}  // namespace
}  // namespace polymorph
