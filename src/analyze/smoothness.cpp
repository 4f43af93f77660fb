#include "analyze/smoothness.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "analyze/measure.h"
#include "kernels/linear.h"
#include "mesh/closest.h"

namespace polymorph {
namespace {

/// Points deeper than this, over L, inside a surface are not visible.
constexpr double kHiddenDepth = 0.01;

/// A measure of an inner frame, and the values of both ends to compare it with.
struct InnerValue {
  double u = 0, value = 0;
  double interpolated = 0;  ///< between the ends' values, at u
  double larger_end = 0;    ///< larger value of the two ends
};

/// Evaluates a measure for every frame but the first and the last.
template <class Value>
std::vector<InnerValue> list_inner_values(const std::vector<FrameMeasures>& rows,
                                          const Value& value) {
  std::vector<InnerValue> inner;
  const double first = value(rows.front()), last = value(rows.back());
  for (std::size_t k = 1; k + 1 < rows.size(); ++k) {
    const double u = rows[k].u;
    inner.push_back({u, value(rows[k]), (1 - u) * first + u * last, std::max(first, last)});
  }
  return inner;
}

/// Returns the largest ratio of an inner value to the larger end's value. One is added to both to
/// avoid a division by 0.
template <class Value>
std::optional<double> find_largest_excess(const std::vector<FrameMeasures>& rows,
                                          const Value& value) {
  std::optional<double> largest;
  for (const InnerValue& inner : list_inner_values(rows, value)) {
    const double ratio = (inner.value + 1) / (inner.larger_end + 1);
    largest = std::max(largest.value_or(ratio), ratio);
  }
  return largest;
}

/// Returns the change of u from frame k to the next one.
double change_of_u(const std::vector<FrameMeasures>& rows, std::size_t k) {
  return std::abs(rows[k + 1].u - rows[k].u);
}

/// Returns the sum of chamfer distances in the first or last tenth of u, divided by the change of
/// u.
double pace_at_end(const std::vector<FrameMeasures>& rows, bool first) {
  constexpr double kTenth = 0.1 - 1e-6;  // a tenth, minus rounding errors of u
  const std::size_t intervals = rows.size() - 1;
  double distance = 0, change = 0;
  for (std::size_t i = 0; i < intervals && change < kTenth; ++i) {
    const std::size_t k = first ? i : intervals - 1 - i;
    distance += rows[k].step;
    change += change_of_u(rows, k);
  }
  return change > 0 ? distance / change : 0;
}

/// Returns the distance from the object to the frame over the mean step between frames. Computes it
/// with the chamfer and with the Hausdorff distance, and returns the larger ratio: a small limb
/// that appears at once hardly changes the chamfer distance. Samples of the object that lie deeper
/// than `hidden_depth` inside the frame are left out.
std::optional<double> steps_from_object(const Mesh& object, const Mesh& frame, double hidden_depth,
                                        const std::vector<FrameMeasures>& rows) {
  double mean = 0, farthest = 0;
  const auto intervals = static_cast<double>(rows.size() - 1);
  for (const FrameMeasures& row : rows) {
    mean += row.step / intervals;
    farthest += row.farthest / intervals;
  }
  if (!(mean > 0 && farthest > 0)) return std::nullopt;
  const MeasuredSurface::Distance step =
      MeasuredSurface(object).distance_to(MeasuredSurface(frame), hidden_depth);
  return std::max(step.mean / mean, step.largest / farthest);
}

/// Removes the faces that lie deeper than `depth` inside a closed surface, where they are not
/// visible: a spout continues inside its pot.
Mesh remove_hidden_faces(Mesh mesh, const Mesh& surface, double depth) {
  const ClosestPointQuery query(surface.positions, surface.triangles);
  const std::vector<ClosestPoint> closest = query.closest(mesh.positions);
  const auto is_hidden = [&](std::uint32_t v) {
    const ClosestPoint& hit = closest[v];
    if (hit.triangle == ClosestPoint::kNoTriangle) return false;
    const auto& corner = surface.triangles[hit.triangle].v;
    const Vec3 a = surface.positions[corner[0]];
    const Vec3 face_normal =
        cross(surface.positions[corner[1]] - a, surface.positions[corner[2]] - a);
    return static_cast<double>(hit.distance) > depth &&
           dot(face_normal, mesh.positions[v] - hit.point) < 0;
  };
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return is_hidden(t.v[0]) && is_hidden(t.v[1]) && is_hidden(t.v[2]);
  });
  return mesh;
}

/// Steps of a boundary stage, as chamfer distances. The pop of a step is its ratio to the mean of
/// the step before and the step after it.
struct BoundarySteps {
  double pop = 0;                ///< largest pop among the steps of the boundary stage
  std::optional<double> before;  ///< last step of the boundary stage; empty if it has no steps
  double jump = 0;               ///< step from the stage's last mesh to the balls' surface
  /// Returns the jump over the mean of the step before it and `after`, the step after it.
  double jump_pop(double after) const {
    const double neighbour_sum = before.value_or(after) + after;
    return neighbour_sum > 0 ? 2 * jump / neighbour_sum : 0;
  }
};
/// Measures the steps of a boundary stage that ends at `surface`; `size` is L.
BoundarySteps measure_boundary_steps(const BoundaryMeshes& stage, const Mesh& surface,
                                     double size) {
  std::vector<double> step;
  MeasuredSurface previous(stage.meshes.front());
  for (std::size_t k = 1; k < stage.meshes.size(); ++k) {
    MeasuredSurface current(stage.meshes[k]);
    step.push_back(previous.distance_to(current).mean);
    previous = std::move(current);
  }
  BoundarySteps steps;
  // A step below 1e-4 of L is noise.
  for (std::size_t k = 1; k + 1 < step.size(); ++k)
    if (step[k] > 1e-4 * size)
      steps.pop = std::max(steps.pop, 2 * step[k] / (step[k - 1] + step[k + 1]));
  if (!step.empty()) steps.before = step.back();
  steps.jump =
      MeasuredSurface(remove_hidden_faces(stage.meshes.back(), surface, kHiddenDepth * size))
          .distance_to(MeasuredSurface(surface))
          .mean;
  return steps;
}

}  // namespace

void add_smoothness_metrics(const MorphEnds& ends, const std::vector<MorphFrame>& frames,
                            double size, Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  double largest_bending = 0;
  for (const FrameMeasures& row : rows) largest_bending = std::max(largest_bending, row.bending);
  const double larger_end = std::max(rows.front().bending, rows.back().bending);
  const auto add = [&](const char* name, std::optional<double> value, const char* goal,
                       const char* definition) {
    analysis.metrics.push_back({name, "5 smoothness", value, goal, definition});
  };
  add("bending", larger_end > 0 ? std::optional(largest_bending / larger_end) : std::nullopt,
      "<= 1", "largest bending energy over the larger one of the ends");
  // Find the largest pop of the frames. Where u hardly changes, the rate is a quotient of two
  // numbers near 0; these intervals are left out.
  constexpr double kSlow = 0.1;  // of the largest change of u
  double max_change = 0;
  for (std::size_t k = 0; k + 1 < rows.size(); ++k)
    max_change = std::max(max_change, rows[k + 1].u - rows[k].u);
  const auto is_long_enough = [&](std::size_t k) {
    return rows[k + 1].u - rows[k].u > kSlow * max_change;
  };
  double pop = 0, mean_rate = 0;
  for (const FrameMeasures& row : rows) mean_rate += row.rate / static_cast<double>(rows.size());
  for (std::size_t k = 1; k + 2 < rows.size(); ++k) {
    if (!is_long_enough(k - 1) || !is_long_enough(k) || !is_long_enough(k + 1)) continue;
    const double neighbour_sum = rows[k - 1].rate + rows[k + 1].rate;
    // Surfaces at rest differ by the sampling, so rates below 1/1000 of the mean, or below 1e-6 of
    // L, are noise.
    if (neighbour_sum > 1e-3 * mean_rate && rows[k].rate > 1e-6 * size)
      pop = std::max(pop, 2 * rows[k].rate / neighbour_sum);
  }
  // Find the largest hand-over and its pop. A hand-over is compared with the step that the
  // volumetric stage would make beside it if u changed uniformly. The rate is that of the interval
  // nearest to the end in which u changes enough.
  const std::size_t intervals = rows.size() - 1;
  const auto uniform_step = [&](bool first) {
    for (std::size_t i = 0; i < intervals; ++i) {
      const std::size_t k = first ? i : intervals - 1 - i;
      if (is_long_enough(k)) return rows[k].rate / static_cast<double>(intervals);
    }
    return 0.0;
  };
  std::optional<double> jump;
  for (const auto& [stage, frame, first] :
       {std::tuple(&ends.leaving, &frames.front(), /*first=*/true),
        std::tuple(&ends.arriving, &frames.back(), /*first=*/false)}) {
    if (stage->meshes.empty()) continue;
    const BoundarySteps steps = measure_boundary_steps(*stage, frame->surface, size);
    jump = std::max(jump.value_or(0), steps.jump / size);
    pop = std::max({pop, steps.pop, steps.jump_pop(uniform_step(first))});
  }
  add("pop", pop, "<= 2",
      "largest pace of a frame over its neighbours' mean, boundary stages and hand-overs included");
  add("handover", jump, "<= 0.002",
      "largest step between an object's mesh and the balls' surface, over L");
}

void add_roughness_metrics(Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  // Compare every inner frame's total absolute curvature with the value interpolated between the
  // ends.
  std::optional<double> curvature, least_curvature, detail;
  for (const InnerValue& inner :
       list_inner_values(rows, [](const auto& row) { return row.roughness.tac; })) {
    if (!(inner.interpolated > 0)) continue;
    const double ratio = inner.value / inner.interpolated;
    curvature = std::max(curvature.value_or(ratio), ratio);
    least_curvature = std::min(least_curvature.value_or(ratio), ratio);
  }
  // Compare the detail in the same way, but average the ratios of the frames in the middle.
  double sum = 0, count = 0;
  constexpr double kEndFraction = 0.2 - 1e-6;  // of u, left out at either end
  for (const InnerValue& inner :
       list_inner_values(rows, [](const auto& row) { return row.roughness.rho; })) {
    if (inner.u < kEndFraction || inner.u > 1 - kEndFraction || !(inner.interpolated > 0)) continue;
    sum += inner.value / inner.interpolated;
    ++count;
  }
  if (count > 0) detail = sum / count;
  const auto add = [&](const char* name, const char* principle, std::optional<double> value,
                       const char* goal, const char* definition) {
    analysis.metrics.push_back({name, principle, value, goal, definition});
  };
  add("curvature", "5 smoothness", curvature, "<= 1.05",
      "largest total absolute curvature over the interpolated one");
  add("least_curvature", "3 features", least_curvature, ">= 0.85",
      "smallest total absolute curvature over the interpolated one; low if limbs melt");
  add("bumps", "5 smoothness",
      find_largest_excess(rows,
                          [](const auto& row) { return static_cast<double>(row.roughness.bumps); }),
      "<= 1.2",
      "largest number of domes with radii below 6 % of L, plus 1, over the larger end's plus 1");
  add("groove", "5 smoothness",
      find_largest_excess(rows, [](const auto& row) { return row.roughness.groove; }), "",
      "largest per cent of the area in grooves, plus 1, over the larger end's plus 1");
  add("detail", "3 features", detail, ">= 0.55",
      "mean roughness for u in 0.2 to 0.8 over the interpolated one; low if detail is blurred");
}

void add_step_metrics(const MorphEnds& ends, const std::vector<MorphFrame>& frames, double size,
                      Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  double distance = 0, change = 0;
  for (std::size_t k = 0; k + 1 < rows.size(); ++k) {
    distance += rows[k].step;
    change += change_of_u(rows, k);
  }
  const auto relative_pace = [&](bool first) -> std::optional<double> {
    if (!(distance > 0 && change > 0)) return std::nullopt;
    return pace_at_end(rows, first) * change / distance;
  };
  const auto object_step = [&](bool shown, const Mesh& object,
                               const Mesh& frame) -> std::optional<double> {
    if (!shown) return std::nullopt;
    return steps_from_object(object, frame, kHiddenDepth * size, rows);
  };
  const auto add = [&](const char* name, std::optional<double> value, const char* goal,
                       const char* definition) {
    analysis.metrics.push_back({name, "5 smoothness", value, goal, definition});
  };
  add("first_step", relative_pace(/*first=*/true), "<= 1.2",
      "pace in the first tenth of u over the mean pace");
  add("last_step", relative_pace(/*first=*/false), "<= 1.2",
      "pace in the last tenth of u over the mean pace");
  add("source_step", object_step(ends.source_shown, ends.source, frames.front().surface), "<= 2",
      "step from the source itself to the first frame over the mean step, by the chamfer or the "
      "Hausdorff distance, whichever gives more");
  add("target_step", object_step(ends.target_shown, ends.target, frames.back().surface), "<= 2",
      "step from the last frame to the target itself over the mean step, by the larger of both "
      "distances");
}

}  // namespace polymorph
