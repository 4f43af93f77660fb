#include "analyze/smoothness.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "analyze/measure.h"

namespace polymorph {
namespace {

/// Where an inner frame is on the way, and a measure of it beside both ends'.
struct Between {
  double u = 0, value = 0, line = 0, larger_end = 0;
};

template <class Value>
std::vector<Between> between_ends(const std::vector<FrameMeasures>& rows, const Value& value) {
  std::vector<Between> inner;
  const double first = value(rows.front()), last = value(rows.back());
  for (std::size_t k = 1; k + 1 < rows.size(); ++k) {
    const double u = rows[k].u;
    inner.push_back({u, value(rows[k]), (1 - u) * first + u * last, std::max(first, last)});
  }
  return inner;
}

/// The largest value over the larger end's; one is added to both, so that nothing at the ends is no
/// division by 0.
template <class Value>
std::optional<double> excess(const std::vector<FrameMeasures>& rows, const Value& value) {
  std::optional<double> largest;
  for (const Between& b : between_ends(rows, value)) {
    const double over = (b.value + 1) / (b.larger_end + 1);
    largest = std::max(largest.value_or(over), over);
  }
  return largest;
}

double change_of_u(const std::vector<FrameMeasures>& rows, std::size_t k) {
  return std::abs(rows[k + 1].u - rows[k].u);
}

/// Chamfer distance gone over the change of u, at one end of the way, while u changes by a tenth.
double pace_at(const std::vector<FrameMeasures>& rows, bool first) {
  constexpr double kTenth = 0.1 - 1e-6;
  const std::size_t intervals = rows.size() - 1;
  double way = 0, time = 0;
  for (std::size_t i = 0; i < intervals && time < kTenth; ++i) {
    const std::size_t k = first ? i : intervals - 1 - i;
    way += rows[k].step;
    time += change_of_u(rows, k);
  }
  return time > 0 ? way / time : 0;
}

/// From one surface to another over the mean step between frames: by the chamfer or by the
/// Hausdorff distance, whichever is more. A small part that appears whole hardly changes the
/// former. What of the object is deeper than `hidden` inside the frame is left out.
std::optional<double> over_mean_step(const Mesh& object, const Mesh& frame, double hidden,
                                     const std::vector<FrameMeasures>& rows) {
  double mean = 0, farthest = 0;
  const auto intervals = static_cast<double>(rows.size() - 1);
  for (const FrameMeasures& row : rows) {
    mean += row.step / intervals;
    farthest += row.farthest / intervals;
  }
  if (!(mean > 0 && farthest > 0)) return std::nullopt;
  const MeasuredSurface::Distance step =
      MeasuredSurface(object).distance_to(MeasuredSurface(frame), hidden);
  return std::max(step.mean / mean, step.largest / farthest);
}

}  // namespace

void add_roughness_metrics(Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  std::optional<double> curvature, detail;
  for (const Between& b : between_ends(rows, [](const auto& row) { return row.roughness.tac; }))
    if (b.line > 0) curvature = std::max(curvature.value_or(0), b.value / b.line);
  double sum = 0, count = 0;
  constexpr double kLeftOut = 0.2 - 1e-6;  // of u, at either end
  for (const Between& b : between_ends(rows, [](const auto& row) { return row.roughness.rho; })) {
    if (b.u < kLeftOut || b.u > 1 - kLeftOut || !(b.line > 0)) continue;
    sum += b.value / b.line;
    ++count;
  }
  if (count > 0) detail = sum / count;
  const auto add = [&](const char* name, const char* principle, std::optional<double> value,
                       const char* goal, const char* what) {
    analysis.metrics.push_back({name, principle, value, goal, what});
  };
  add("curvature", "5 smoothness", curvature, "<= 1.05",
      "largest total absolute curvature over the line between the ends");
  add("bumps", "5 smoothness",
      excess(rows, [](const auto& row) { return static_cast<double>(row.roughness.bumps); }),
      "<= 1.2", "most domes with radii below 6 % of L, and one, over the larger end's, and one");
  add("groove", "5 smoothness", excess(rows, [](const auto& row) { return row.roughness.groove; }),
      "", "largest per cent of the area in grooves, and one, over the larger end's, and one");
  add("detail", "3 features", detail, ">= 0.55",
      "mean roughness for u in 0.2 to 0.8 over the line between the ends: what is not blurred");
}

void add_step_metrics(const MorphEnds& ends, const std::vector<MorphFrame>& frames, double size,
                      Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  double way = 0, time = 0;
  for (std::size_t k = 0; k + 1 < rows.size(); ++k) {
    way += rows[k].step;
    time += change_of_u(rows, k);
  }
  const auto over_mean_pace = [&](bool first) -> std::optional<double> {
    if (!(way > 0 && time > 0)) return std::nullopt;
    return pace_at(rows, first) * time / way;
  };
  const auto from_object = [&](bool shown, const Mesh& object,
                               const Mesh& frame) -> std::optional<double> {
    if (!shown) return std::nullopt;
    return over_mean_step(object, frame, kHiddenDepth * size, rows);
  };
  const auto add = [&](const char* name, std::optional<double> value, const char* goal,
                       const char* what) {
    analysis.metrics.push_back({name, "5 smoothness", value, goal, what});
  };
  add("first_step", over_mean_pace(true), "<= 1.2",
      "pace over the first tenth of u over the mean pace");
  add("last_step", over_mean_pace(false), "<= 1.2",
      "pace over the last tenth of u over the mean pace");
  add("source_step", from_object(ends.source_shown, ends.source, frames.front().surface), "<= 2",
      "step from the source itself to the first frame over the mean step, by the chamfer or the "
      "Hausdorff distance, whichever is more");
  add("target_step", from_object(ends.target_shown, ends.target, frames.back().surface), "<= 2",
      "step from the last frame to the target itself over the mean step, likewise");
}

}  // namespace polymorph
