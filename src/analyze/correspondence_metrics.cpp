#include "analyze/correspondence_metrics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace polymorph {
namespace {

/// Returns the fraction of the errors that are at most `limit`; nullopt if there are no errors.
std::optional<double> fraction_within(const std::vector<double>& errors, double limit) {
  if (errors.empty()) return std::nullopt;
  const auto count =
      std::count_if(errors.begin(), errors.end(), [&](double error) { return error <= limit; });
  return static_cast<double>(count) / static_cast<double>(errors.size());
}

/// Returns the mean error; nullopt if there are no errors or one is infinite.
std::optional<double> mean_error(const std::vector<double>& errors) {
  const double sum = std::accumulate(errors.begin(), errors.end(), 0.0);
  if (errors.empty() || !std::isfinite(sum)) return std::nullopt;
  return sum / static_cast<double>(errors.size());
}

}  // namespace

void add_correspondence_metrics(const MorphEnds& ends, Analysis& analysis) {
  const auto add = [&](const char* name, std::optional<double> value, const char* goal,
                       const char* definition) {
    analysis.metrics.push_back({name, "3 features", value, goal, definition});
  };
  const TrueErrors errors = ends.true_errors.value_or(TrueErrors{});
  add("points", ends.true_errors ? std::optional(static_cast<double>(errors.points)) : std::nullopt,
      "", "pairs of true points (--truth)");
  add("plan_within_5", fraction_within(errors.plan, 0.05), "",
      "share of true points that the plan's balls take to within 5 % of the diagonal of their "
      "partners");
  add("plan_within_10", fraction_within(errors.plan, 0.1), ">= 0.7",
      "share of true points that the plan's balls take to within 10 % of it");
  add("plan_error", mean_error(errors.plan), "<= 0.09",
      "mean distance from where the plan's balls take true points to their partners, over the "
      "diagonal");
  add("map_within_5", fraction_within(errors.map, 0.05), "",
      "share of true points that the surface's map takes to within 5 % of the diagonal of their "
      "partners");
  add("map_within_10", fraction_within(errors.map, 0.1), ">= 0.7",
      "share of true points that the surface's map takes to within 10 % of it");
  add("map_error", mean_error(errors.map), "<= 0.09",
      "mean distance from where the map takes true points to their partners, over the diagonal");
  add("map_geodesic", mean_error(errors.geodesic), "<= 0.07",
      "mean distance along the target from where the map takes true points to their partners, over "
      "the square root of its area");
  add("true_facing", errors.facing, "<= 15",
      "degrees about the vertical between the morph's rotation and that of the true points");
  add("facing", ends.facing, "<= 15",
      "degrees about the vertical between the morph's rotation and that of the plan's pairs");
  add("registration", ends.registration, "<= 0.05",
      "share of an object's area that the map misses by more than half its thickness; the larger "
      "of "
      "both");
  add("pose_step", ends.pose_step, "<= 1.2",
      "moving ends: largest step that a change of poses alone makes, at one time of the morph, "
      "over "
      "the larger end's own step");
}

void add_body_metrics(Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  const FrameMeasures &first = rows.front(), &last = rows.back();
  const double height = std::max(first.height, last.height);
  std::optional<double> hull_dip, distortion;
  double floating = 0, sinking = 0;
  for (const FrameMeasures& row : rows) {
    const double interpolated_hull = (1 - row.u) * first.hull + row.u * last.hull;
    if (interpolated_hull > 0)
      hull_dip = std::min(hull_dip.value_or(INFINITY), row.hull / interpolated_hull);
    // Height of the lowest point above the height interpolated between the ends.
    const double lift = row.lowest - ((1 - row.u) * first.lowest + row.u * last.lowest);
    floating = std::max(floating, lift);
    sinking = std::max(sinking, -lift);
    if (row.distortion) distortion = std::max(distortion.value_or(1), *row.distortion);
  }
  const auto over_height = [&](double lift) {
    return height > 0 ? std::optional(lift / height) : std::nullopt;
  };
  analysis.metrics.push_back(
      {"hull_dip", "6 monotonicity", hull_dip, ">= 0.85",
       "smallest volume of the convex hull over the interpolated one; low if limbs are lost"});
  analysis.metrics.push_back(
      {"floating", "floor", over_height(floating), "<= 0.005",
       "largest height of the lowest point above the interpolated one, over the height"});
  analysis.metrics.push_back(
      {"sinking", "floor", over_height(sinking), "<= 0.005",
       "largest depth of the lowest point below the interpolated one, over the height"});
  analysis.metrics.push_back(
      {"distortion", "4 rigidity", distortion, "",
       "largest mean ratio of the principal stretches, where all meshes have the same triangles"});
}

}  // namespace polymorph
